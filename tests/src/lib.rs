//! The tests are in `tests/`, one target for each way of running; here is what they share.

/// Says that a test can't run here, why, and how to get what is missing.
///
/// # Panics
/// Under `CI=true`, where a missing tool is a failure.
pub fn skip(reason: &str) {
    assert!(
        std::env::var_os("CI").is_none_or(|value| value != "true"),
        "{reason}"
    );
    println!("skipped: {reason}");
}
