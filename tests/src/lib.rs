//! The tests are in `tests/`, one target for each way of running.
