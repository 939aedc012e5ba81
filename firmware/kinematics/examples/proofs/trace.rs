//! Fixed-point computations as lists of integer operations, to run and to prove.
//!
//! A stage of the kernel is written once, over [`Trace`]. `Trace::run` computes it in integers, and the
//! tests hold that to the kernel's bits; [`crate::script::Script`] prints the same list for Gappa. So what is
//! proven is what runs.

/// A number of a trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Value(pub usize);

/// What makes a number of others.
#[cfg_attr(
    not(test),
    expect(dead_code, reason = "only whole chains have them, which tests run")
)]
#[derive(Clone, Copy, Debug)]
pub enum Operation {
    /// From outside.
    Input,
    /// The same always.
    Constant(i64),
    /// a + b.
    Add(Value, Value),
    /// a − b.
    Subtract(Value, Value),
    /// −a.
    Negate(Value),
    /// −a less one step.
    Not(Value),
    /// The same number in a format of more bits.
    ShiftLeft(Value, u32),
    /// The number in a format of fewer bits, rounded down.
    ShiftRight(Value, u32),
    /// The same bits in another format.
    ReadAs(Value),
    /// The high half of the product, rounded down.
    High(Value, Value),
    /// The whole product.
    Wide(Value, Value),
    /// The quotient, rounded towards zero.
    Divide(Value, Value),
    /// The quotient of two numbers that are not negative, rounded down.
    DivideUnsigned(Value, Value),
    /// `eel_units::ratio_q30`.
    Ratio(Value, Value),
    /// `eel_units::root_near`.
    Root(Value),
    /// The sine of `eel_units::sin_cos_near`.
    Sine(Value),
    /// The cosine of `eel_units::sin_cos_near`.
    Cosine(Value),
    /// `eel_units::arctangents`.
    Arctangent(Value),
}

/// Which integers hold a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// `i32`.
    Signed,
    /// `u32`.
    Unsigned,
    /// `i32` that wraps and is then read as `u32`.
    Either,
    /// `i64`.
    Long,
}

impl Width {
    /// Returns the least and the largest integer.
    pub const fn limits(self) -> (i64, i64) {
        match self {
            Self::Signed => (i32::MIN as i64, i32::MAX as i64),
            Self::Unsigned => (0, u32::MAX as i64),
            Self::Either => (i32::MIN as i64, u32::MAX as i64),
            Self::Long => (i64::MIN, i64::MAX),
        }
    }
}

/// One number: how it is made, what it is called, and its format.
#[derive(Clone, Debug)]
pub struct Node {
    /// In the script.
    pub name: String,
    /// Of what.
    pub operation: Operation,
    /// The number is the integer over 2 to this.
    pub bits: i32,
    /// What holds it.
    pub width: Width,
}

/// A list of operations, each on earlier ones.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    nodes: Vec<Node>,
}

impl Trace {
    fn push(&mut self, name: &str, operation: Operation, bits: i32, width: Width) -> Value {
        self.nodes.push(Node {
            name: name.to_owned(),
            operation,
            bits,
            width,
        });
        Value(self.nodes.len() - 1)
    }

    /// Returns all numbers, earlier ones first.
    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }

    /// Returns a handle for each number.
    pub fn values(&self) -> impl Iterator<Item = Value> {
        (0..self.nodes.len()).map(Value)
    }

    /// Finds a number by its name.
    ///
    /// # Panics
    /// When there is none.
    pub fn find(&self, name: &str) -> Value {
        let place = self.nodes.iter().position(|node| node.name == name);
        Value(place.expect("a number of that name"))
    }

    /// Returns one number.
    pub fn node(&self, value: Value) -> &Node {
        &self.nodes[value.0]
    }

    fn bits(&self, value: Value) -> i32 {
        self.node(value).bits
    }

    /// Says that `u32` holds the number.
    pub fn unsigned(&mut self, value: Value) -> Value {
        self.nodes[value.0].width = Width::Unsigned;
        value
    }

    /// Says that `i32` wraps and is then read as `u32`.
    pub fn either(&mut self, value: Value) -> Value {
        self.nodes[value.0].width = Width::Either;
        value
    }

    /// Says that `i64` holds the number.
    pub fn long(&mut self, value: Value) -> Value {
        self.nodes[value.0].width = Width::Long;
        value
    }

    /// Says that `i32` holds the number.
    pub fn short(&mut self, value: Value) -> Value {
        self.nodes[value.0].width = Width::Signed;
        value
    }

    /// Takes a number from outside.
    pub fn input(&mut self, name: &str, bits: i32) -> Value {
        self.push(name, Operation::Input, bits, Width::Signed)
    }

    /// Takes numbers from outside.
    pub fn inputs<const N: usize>(&mut self, names: [&str; N], bits: i32) -> [Value; N] {
        names.map(|name| self.input(name, bits))
    }

    /// Makes a constant.
    pub fn constant(&mut self, name: &str, integer: i64, bits: i32) -> Value {
        self.push(name, Operation::Constant(integer), bits, Width::Signed)
    }

    /// Adds two numbers of one format.
    pub fn add(&mut self, name: &str, a: Value, b: Value) -> Value {
        assert_eq!(self.bits(a), self.bits(b), "{name}: formats differ");
        let width = self.node(a).width;
        self.push(name, Operation::Add(a, b), self.bits(a), width)
    }

    /// Subtracts two numbers of one format.
    pub fn subtract(&mut self, name: &str, a: Value, b: Value) -> Value {
        assert_eq!(self.bits(a), self.bits(b), "{name}: formats differ");
        let width = self.node(a).width;
        self.push(name, Operation::Subtract(a, b), self.bits(a), width)
    }

    /// Changes the sign.
    pub fn negate(&mut self, name: &str, a: Value) -> Value {
        self.push(name, Operation::Negate(a), self.bits(a), Width::Signed)
    }

    /// Turns all bits.
    pub fn not(&mut self, name: &str, a: Value) -> Value {
        self.push(name, Operation::Not(a), self.bits(a), Width::Signed)
    }

    /// Shifts to a format of more bits.
    pub fn left(&mut self, name: &str, a: Value, count: u32) -> Value {
        let bits = self.bits(a) + count as i32;
        self.push(name, Operation::ShiftLeft(a, count), bits, Width::Signed)
    }

    /// Shifts to a format of fewer bits, in `i32`.
    pub fn right(&mut self, name: &str, a: Value, count: u32) -> Value {
        let bits = self.bits(a) - count as i32;
        self.push(name, Operation::ShiftRight(a, count), bits, Width::Signed)
    }

    /// Reads the bits in another format.
    pub fn read_as(&mut self, name: &str, a: Value, bits: i32) -> Value {
        let width = self.node(a).width;
        self.push(name, Operation::ReadAs(a), bits, width)
    }

    /// Halves a number in its format, rounded down to a whole step.
    pub fn half(&mut self, name: &str, a: Value, count: u32) -> Value {
        let bits = self.bits(a);
        let shifted = self.right(&format!("{name}_shifted"), a, count);
        self.read_as(name, shifted, bits)
    }

    /// `multiply_high`.
    pub fn high(&mut self, name: &str, a: Value, b: Value) -> Value {
        let bits = self.bits(a) + self.bits(b) - 32;
        self.push(name, Operation::High(a, b), bits, Width::Signed)
    }

    /// `multiply_high_add`.
    pub fn high_add(&mut self, name: &str, sum: Value, a: Value, b: Value) -> Value {
        let product = self.high(&format!("{name}_part"), a, b);
        self.add(name, sum, product)
    }

    /// The sum of products in 64 bits.
    pub fn products(&mut self, name: &str, pairs: &[(Value, Value)]) -> Value {
        let mut sum = None;
        for (index, &(a, b)) in pairs.iter().enumerate() {
            let bits = self.bits(a) + self.bits(b);
            let product = self.push(
                &format!("{name}_product{index}"),
                Operation::Wide(a, b),
                bits,
                Width::Long,
            );
            sum = Some(match sum {
                None => product,
                Some(sum) => self.add(&format!("{name}_sum{index}"), sum, product),
            });
        }
        sum.expect("a product")
    }

    /// A sum of products, shifted right to `i32`.
    pub fn dot(&mut self, name: &str, pairs: &[(Value, Value)], count: u32) -> Value {
        let sum = self.products(name, pairs);
        self.right(name, sum, count)
    }

    /// SDIV.
    pub fn divide(&mut self, name: &str, a: Value, b: Value) -> Value {
        let bits = self.bits(a) - self.bits(b);
        self.push(name, Operation::Divide(a, b), bits, Width::Signed)
    }

    /// UDIV.
    pub fn divide_unsigned(&mut self, name: &str, a: Value, b: Value) -> Value {
        let bits = self.bits(a) - self.bits(b);
        self.push(name, Operation::DivideUnsigned(a, b), bits, Width::Unsigned)
    }

    /// `ratio_q30`.
    pub fn ratio(&mut self, name: &str, a: Value, b: Value) -> Value {
        let bits = 30 + self.bits(a) - self.bits(b);
        self.push(name, Operation::Ratio(a, b), bits, Width::Signed)
    }

    /// `root_near`.
    pub fn root(&mut self, name: &str, a: Value) -> Value {
        assert_eq!(self.bits(a), 31, "{name}: a root of Q31");
        self.push(name, Operation::Root(a), 30, Width::Signed)
    }

    /// `sin_cos_near` of an angle in Q29.
    #[cfg_attr(
        not(test),
        expect(dead_code, reason = "only whole chains have them, which tests run")
    )]
    pub fn sine_cosine(&mut self, name: &str, angle: Value) -> [Value; 2] {
        assert_eq!(self.bits(angle), 29, "{name}: an angle is in Q29");
        let (sine, cosine) = (format!("sine_{name}"), format!("cosine_{name}"));
        [
            self.push(&sine, Operation::Sine(angle), 30, Width::Signed),
            self.push(&cosine, Operation::Cosine(angle), 30, Width::Signed),
        ]
    }

    /// `arctangents` of a tangent in Q31.
    pub fn arctangent(&mut self, name: &str, tangent: Value) -> Value {
        assert_eq!(self.bits(tangent), 31, "{name}: a tangent is in Q31");
        self.push(name, Operation::Arctangent(tangent), 30, Width::Signed)
    }
}
