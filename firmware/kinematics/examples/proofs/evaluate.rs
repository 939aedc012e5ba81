//! Running of traces: in integers, and without any rounding.

use eel_units::{Angle, arctangents, ratio_q30, root_near, sin_cos_near};

use crate::trace::{Operation, Trace, Value};

impl Trace {
    /// Computes all numbers from the inputs, in integers.
    ///
    /// # Panics
    /// When a number does not fit, or there are too few inputs.
    pub fn run(&self, inputs: &[i64]) -> Run {
        let mut given = inputs.iter().copied();
        let mut integers: Vec<i64> = Vec::with_capacity(self.nodes().len());
        for node in self.nodes() {
            let integer = match node.operation {
                Operation::Input => given.next().expect("an input"),
                operation => compute(operation, |value| integers[value.0]),
            };
            let (low, high) = node.width.limits();
            let name = &node.name;
            assert!((low..=high).contains(&integer), "{name} overflows");
            integers.push(integer);
        }
        assert_eq!(given.next(), None, "an input is left over");
        Run(integers)
    }

    /// Computes all numbers in real arithmetic, without any rounding.
    pub fn idealize(&self, inputs: &[f64]) -> Vec<f64> {
        let mut given = inputs.iter().copied();
        let mut numbers: Vec<f64> = Vec::with_capacity(self.nodes().len());
        for node in self.nodes() {
            let at = |value: Value| numbers[value.0];
            let number = match node.operation {
                Operation::Input => given.next().expect("an input"),
                Operation::Constant(integer) => integer as f64 * 0.5f64.powi(node.bits),
                Operation::Add(a, b) => at(a) + at(b),
                Operation::Subtract(a, b) => at(a) - at(b),
                Operation::Negate(a) | Operation::Not(a) => -at(a),
                Operation::ShiftLeft(a, _) | Operation::ShiftRight(a, _) => at(a),
                Operation::ReadAs(a) => at(a) * 2.0f64.powi(self.node(a).bits - node.bits),
                Operation::High(a, b) | Operation::Wide(a, b) => at(a) * at(b),
                Operation::Divide(a, b)
                | Operation::DivideUnsigned(a, b)
                | Operation::Ratio(a, b) => at(a) / at(b),
                Operation::Root(a) => at(a).sqrt(),
                Operation::Sine(a) => at(a).sin(),
                Operation::Cosine(a) => at(a).cos(),
                Operation::Arctangent(a) => at(a).atan(),
            };
            numbers.push(number);
        }
        numbers
    }

    /// Returns a number of those of [`Trace::idealize`].
    pub fn ideal(&self, numbers: &[f64], value: Value) -> f64 {
        numbers[value.0]
    }
}

/// All numbers of a trace for some inputs.
pub struct Run(Vec<i64>);

impl Run {
    /// Returns one integer.
    pub fn at(&self, value: Value) -> i64 {
        self.0[value.0]
    }
}

/// Computes one operation in integers.
fn compute(operation: Operation, at: impl Fn(Value) -> i64) -> i64 {
    let short = |value| i32::try_from(at(value)).expect("checked when it was made");
    let angles = |value| sin_cos_near([Angle::from_q29(short(value))])[0];
    match operation {
        Operation::Input => unreachable!("inputs come from outside"),
        Operation::Constant(integer) => integer,
        Operation::Add(a, b) => at(a).checked_add(at(b)).expect("fits i64"),
        Operation::Subtract(a, b) => at(a).checked_sub(at(b)).expect("fits i64"),
        Operation::Negate(a) => -at(a),
        Operation::Not(a) => !at(a),
        Operation::ShiftLeft(a, count) => at(a) << count,
        Operation::ShiftRight(a, count) => at(a) >> count,
        Operation::ReadAs(a) => at(a),
        Operation::High(a, b) => (at(a) * at(b)) >> 32,
        Operation::Wide(a, b) => at(a) * at(b),
        Operation::Divide(a, b) | Operation::DivideUnsigned(a, b) => at(a) / at(b),
        Operation::Ratio(a, b) => ratio_q30(short(a), short(b)).into(),
        Operation::Root(a) => root_near(short(a)).into(),
        Operation::Sine(a) => angles(a).0.into(),
        Operation::Cosine(a) => angles(a).1.into(),
        Operation::Arctangent(a) => arctangents([short(a)])[0].into(),
    }
}
