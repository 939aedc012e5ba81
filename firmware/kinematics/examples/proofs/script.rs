//! What Gappa reads: a trace with its exact twin, hypotheses, goals and hints.

use std::fmt::Write;

use crate::trace::{Operation, Trace, Value, Width};

/// A closed interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range(pub f64, pub f64);

/// A proof: numbers of a trace, what is known of them, and what is claimed.
pub struct Script {
    /// The file's name, without its ending.
    pub file: &'static str,
    /// What the table says.
    pub stage: &'static str,
    /// The claims that the table names, with their bounds.
    pub claims: Vec<(String, f64)>,
    /// The numbers, with names of their own.
    pub trace: Trace,
    why: Vec<String>,
    definitions: Vec<String>,
    last: Vec<String>,
    hypotheses: Vec<String>,
    goals: Vec<String>,
    hints: Vec<String>,
    twins: bool,
    /// Keeps improvements of a range however small.
    pub sharp: bool,
    exact_inputs: Vec<String>,
}

/// Returns the name of an exact twin.
fn twin(name: &str) -> String {
    format!("exact_{name}")
}

impl Script {
    /// Makes an empty script. With twins each number gets an exact one, computed without rounding.
    pub fn new(file: &'static str, stage: &'static str, twins: bool) -> Self {
        Self {
            file,
            stage,
            claims: Vec::new(),
            trace: Trace::default(),
            why: Vec::new(),
            definitions: Vec::new(),
            last: Vec::new(),
            hypotheses: Vec::new(),
            goals: Vec::new(),
            hints: Vec::new(),
            twins,
            sharp: false,
            exact_inputs: Vec::new(),
        }
    }

    /// Returns the name of a number; a shift to more bits changes nothing and has none of its own.
    pub fn name(&self, value: Value) -> String {
        let node = self.trace.node(value);
        match node.operation {
            Operation::ShiftLeft(a, _) => self.name(a),
            _ => node.name.clone(),
        }
    }

    /// Returns the name of a number's exact twin.
    pub fn exact(&self, value: Value) -> String {
        let node = self.trace.node(value);
        match node.operation {
            Operation::Constant(_) => node.name.clone(),
            Operation::ShiftLeft(a, _) | Operation::ShiftRight(a, _) => self.exact(a),
            Operation::Input if self.exact_inputs.contains(&node.name) => node.name.clone(),
            _ => twin(&node.name),
        }
    }

    /// Says in a comment what a hypothesis rests on.
    pub fn because(&mut self, reason: &str) {
        self.why.push(reason.to_owned());
    }

    /// Adds a definition.
    pub fn define(&mut self, text: impl Into<String>) {
        self.definitions.push(text.into());
    }

    /// Adds a definition that names numbers of the trace.
    pub fn define_last(&mut self, text: impl Into<String>) {
        self.last.push(text.into());
    }

    /// Adds a hypothesis.
    pub fn suppose(&mut self, text: impl Into<String>) {
        self.hypotheses.push(text.into());
    }

    /// Supposes that an expression is within a range.
    pub fn suppose_within(&mut self, expression: &str, Range(low, high): Range) {
        self.suppose(format!("{expression} in [{low:e},{high:e}]"));
    }

    /// Supposes of an input the range of its exact twin and how far it is from it.
    pub fn suppose_near(&mut self, value: Value, range: Range, error: f64) {
        let name = self.name(value);
        self.suppose_within(&twin(&name), range);
        self.suppose(format!("|{name} - {}| <= {error:e}", twin(&name)));
        let bits = self.trace.node(value).bits;
        self.suppose(format!("@FIX({name},{})", -bits));
    }

    /// Supposes of an input that it is exact, within a range.
    pub fn suppose_exact(&mut self, value: Value, range: Range) {
        let name = self.name(value);
        self.exact_inputs.push(name.clone());
        self.suppose_within(&name, range);
        let bits = self.trace.node(value).bits;
        self.suppose(format!("@FIX({name},{})", -bits));
    }

    /// Adds a goal.
    pub fn claim(&mut self, text: impl Into<String>) {
        self.goals.push(text.into());
    }

    /// Claims that an expression is within a range.
    pub fn claim_within(&mut self, expression: &str, Range(low, high): Range) {
        self.claim(format!("{expression} in [{low:e},{high:e}]"));
    }

    /// Claims that a number is within an error of its exact twin, in the table as `what`.
    pub fn claim_near(&mut self, value: Value, error: f64, what: &str) {
        let (name, exact) = (self.name(value), self.exact(value));
        self.claim(format!("|{name} - {exact}| <= {error:e}"));
        self.note(what, error);
    }

    /// Puts a claim into the table.
    pub fn note(&mut self, what: &str, bound: f64) {
        if !what.is_empty() {
            self.claims.push((what.to_owned(), bound));
        }
    }

    /// Adds a hint.
    pub fn hint(&mut self, text: impl Into<String>) {
        self.hints.push(text.into());
    }

    /// Supposes how far a quotient or root is from that of its arguments, and says how errors pass.
    pub fn suppose_primitive(&mut self, value: Value, error: f64) {
        let node = self.trace.node(value).clone();
        let (x, exact) = (node.name.clone(), twin(&node.name));
        self.suppose(format!("@FIX({x},{})", -node.bits));
        match node.operation {
            Operation::Ratio(a, b) => {
                let scale = 0.5f64.powi(node.bits - 30);
                let (ea, eb) = (self.exact(a), self.exact(b));
                let (a, b) = (self.name(a), self.name(b));
                self.suppose(format!("|{x} - {a} / {b}| <= {:e}", error * scale));
                if self.twins {
                    self.hint(format!(
                        "{x} - {exact} -> ({x} - {a} / {b}) + (({a} - {ea}) - {exact} * ({b} - {eb})) / {b} {{ {b} <> 0, {eb} <> 0 }};"
                    ));
                }
            }
            Operation::Root(a) => {
                let (a, ea) = (self.name(a), self.exact(a));
                self.suppose(format!("|{x} - sqrt({a})| <= {error:e}"));
                if self.twins {
                    self.hint(format!(
                        "{x} - {exact} -> ({x} - sqrt({a})) + (sqrt({a}) - sqrt({ea}));"
                    ));
                    self.hint(format!(
                        "sqrt({a}) - sqrt({ea}) -> ({a} - {ea}) / (sqrt({a}) + sqrt({ea})) {{ sqrt({a}) + sqrt({ea}) <> 0, {a} >= 0, {ea} >= 0 }};"
                    ));
                }
            }
            _ => unreachable!("{x} is no primitive"),
        }
    }

    /// Returns the text for Gappa.
    pub fn text(&self) -> String {
        let mut text = String::new();
        if self.sharp {
            text.push_str("#@ -Echange-threshold=0.0\n");
        }
        let _ = writeln!(text, "# {}\n# Generated: cargo xtask proofs.", self.stage);
        for reason in &self.why {
            let _ = writeln!(text, "# {reason}");
        }
        for line in &self.definitions {
            let _ = writeln!(text, "{line}");
        }
        for node in self.trace.nodes() {
            if let Some(formula) = self.formula(&node.operation, node.bits) {
                let _ = writeln!(text, "{} = {formula};", node.name);
            }
            if self.twins
                && !matches!(node.operation, Operation::Constant(_))
                && let Some(formula) = self.exact_formula(&node.operation, node.bits)
            {
                let _ = writeln!(text, "{} = {formula};", twin(&node.name));
            }
        }
        for line in &self.last {
            let _ = writeln!(text, "{line}");
        }
        let mut goals = self.overflow_goals();
        goals.extend(self.goals.iter().cloned());
        let _ = write!(
            text,
            "{{ {}\n->\n{} }}\n",
            self.hypotheses.join(" /\\\n"),
            goals.join(" /\\\n")
        );
        for hint in self.hints_of_operations().iter().chain(&self.hints) {
            let _ = writeln!(text, "{hint}");
        }
        text
    }

    /// Returns what Gappa does not see by itself: an opposite of all bits is one step from the opposite.
    fn hints_of_operations(&self) -> Vec<String> {
        let mut hints = Vec::new();
        for (node, value) in self.trace.nodes().iter().zip(self.trace.values()) {
            if let (Operation::Not(a), true) = (node.operation, self.twins) {
                let (x, exact) = (self.name(value), self.exact(value));
                let (a, exact_a) = (self.name(a), self.exact(a));
                let step = -node.bits;
                hints.push(format!("{x} - {exact} -> -({a} - {exact_a}) - 1b{step};"));
                hints.push(format!("{x} ~ {exact};"));
            }
        }
        hints
    }

    /// Returns that every number fits its integer.
    fn overflow_goals(&self) -> Vec<String> {
        let mut goals = Vec::new();
        for (node, value) in self.trace.nodes().iter().zip(self.trace.values()) {
            let read = matches!(
                node.operation,
                Operation::Input | Operation::Constant(_) | Operation::ReadAs(_)
            );
            if read {
                continue;
            }
            let (low, high) = node.width.limits();
            // A sum of products ends one step earlier, which Gappa takes as well.
            let high = if node.width == Width::Long {
                high >> 1 << 1
            } else {
                high
            };
            let bits = -node.bits;
            let name = self.name(value);
            goals.push(format!("{name} in [{low}b{bits},{high}b{bits}]"));
        }
        goals
    }

    /// Returns how a number is computed; nothing for what comes from outside.
    fn formula(&self, operation: &Operation, bits: i32) -> Option<String> {
        let name = |value: Value| self.name(value);
        let rounded = |mode: &str, text: String| format!("fixed<{},{mode}>({text})", -bits);
        Some(match *operation {
            Operation::Not(a) => format!("-{} - 1b{}", name(a), -bits),
            Operation::ShiftRight(a, _) => rounded("dn", name(a)),
            Operation::High(a, b) => rounded("dn", format!("{} * {}", name(a), name(b))),
            Operation::Divide(a, b) => rounded("zr", format!("{} / {}", name(a), name(b))),
            Operation::DivideUnsigned(a, b) => rounded("dn", format!("{} / {}", name(a), name(b))),
            Operation::Ratio(..) | Operation::Root(_) => return None,
            Operation::Sine(_) | Operation::Cosine(_) | Operation::Arctangent(_) => return None,
            operation => return self.plain_formula(operation, bits, name),
        })
    }

    /// Returns how a number's exact twin is computed.
    fn exact_formula(&self, operation: &Operation, bits: i32) -> Option<String> {
        let name = |value: Value| self.exact(value);
        Some(match *operation {
            Operation::Not(a) => format!("-{}", name(a)),
            Operation::ShiftRight(..) => return None,
            Operation::High(a, b) => format!("{} * {}", name(a), name(b)),
            Operation::Divide(a, b) | Operation::DivideUnsigned(a, b) | Operation::Ratio(a, b) => {
                format!("{} / {}", name(a), name(b))
            }
            Operation::Root(a) => format!("sqrt({})", name(a)),
            Operation::Sine(_) | Operation::Cosine(_) | Operation::Arctangent(_) => return None,
            operation => return self.plain_formula(operation, bits, name),
        })
    }

    /// Returns the formula of what is the same with and without rounding.
    fn plain_formula(
        &self,
        operation: Operation,
        bits: i32,
        name: impl Fn(Value) -> String,
    ) -> Option<String> {
        Some(match operation {
            Operation::Constant(integer) => format!("{integer}b{}", -bits),
            Operation::Add(a, b) => format!("{} + {}", name(a), name(b)),
            Operation::Subtract(a, b) => format!("{} - {}", name(a), name(b)),
            Operation::Negate(a) => format!("-{}", name(a)),
            Operation::Wide(a, b) => format!("{} * {}", name(a), name(b)),
            Operation::ReadAs(a) => {
                format!("{} * 1b{}", name(a), self.trace.node(a).bits - bits)
            }
            _ => return None,
        })
    }
}
