//! Errors of the kernel beside those of single precision, as the measuring program prints them.

use std::fmt;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

/// How many times less the kernel's angles must err than those of single precision.
const LEAST_RATIO: f64 = 30.0;

/// The largest errors over all poses.
pub struct Errors {
    poses: u64,
    /// An angle of the inverse, the direct kinematics' orientation, in radians.
    inverse: Pair,
    direct: Pair,
    /// A torque for a moment of 1 N·m, N·m.
    torque: Pair,
}

/// One error of both.
struct Pair {
    kernel: f64,
    single: f64,
}

impl Errors {
    /// Reads what the program prints.
    ///
    /// # Errors
    /// When that is something else.
    pub fn read(text: &str) -> Result<Self> {
        let find = |name: &str| {
            let mut lines = text.lines().filter_map(|line| line.split_once('\t'));
            let (_, words) = lines
                .find(|(word, _)| *word == name)
                .with_context(|| format!("no {name} among the errors"))?;
            anyhow::Ok(words)
        };
        let pair = |name: &str| {
            let (kernel, single) = find(name)?.split_once('\t').context("one error only")?;
            let pair = Pair {
                kernel: kernel.parse()?,
                single: single.parse()?,
            };
            ensure!(pair.kernel > 0.0 && pair.single > 0.0, "{name}: no error");
            anyhow::Ok(pair)
        };
        Ok(Self {
            poses: find("poses")?.parse()?,
            inverse: pair("inverse")?,
            direct: pair("direct")?,
            torque: pair("torque")?,
        })
    }

    fn all(&self) -> [(&'static str, &'static str, &Pair); 3] {
        [
            ("inverse", "µrad", &self.inverse),
            ("direct", "µrad", &self.direct),
            ("torque", "µN·m per N·m", &self.torque),
        ]
    }

    /// Returns where single precision comes too near.
    pub fn complaints(&self) -> Vec<String> {
        let angles = [("inverse", &self.inverse), ("direct", &self.direct)];
        let near = angles
            .into_iter()
            .filter(|(_, pair)| pair.ratio() < LEAST_RATIO);
        near.map(|(name, pair)| {
            format!(
                "{name} errs only {:.1} times less than f32, {LEAST_RATIO} wanted",
                pair.ratio()
            )
        })
        .collect()
    }

    /// Returns all of them.
    pub fn to_json(&self) -> Value {
        let mut value = json!({ "poses": self.poses });
        for (name, _, pair) in self.all() {
            value[name] = json!({
                "kernel": pair.kernel, "f32": pair.single, "ratio": pair.ratio(),
            });
        }
        value
    }
}

impl Pair {
    fn ratio(&self) -> f64 {
        self.single / self.kernel
    }
}

impl fmt::Display for Errors {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            out,
            "largest errors against f64 (`design`), {} poses of the workspace, this machine",
            self.poses
        )?;
        for (name, unit, pair) in self.all() {
            let (kernel, single) = (pair.kernel * 1e6, pair.single * 1e6);
            write!(
                out,
                "\n{name:<10}{kernel:>8.4} {unit}, f32 {single:.4}: {:.1} times less",
                pair.ratio()
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::Errors;

    #[test]
    fn complains_below_thirty_times_for_angles() {
        let text = |single| {
            format!("poses\t5\ninverse\t1e-8\t{single}\ndirect\t1e-8\t4e-7\ntorque\t1e-8\t2e-8")
        };
        let complaints = |single| Errors::read(&text(single)).unwrap().complaints().len();
        assert_eq!(complaints("3.1e-7"), 0);
        assert_eq!(complaints("2.9e-7"), 1);
        assert!(Errors::read("poses\t5\ninverse\t1e-8").is_err());
    }
}
