//! The clocks and interrupt priorities in docs/hardware.md, held to the board.

use super::{BOARD, PAGE, board_code, expect_none, number_after, table, text};

/// Returns the divider that embassy-stm32 0.6 takes for an SPI (`compute_baud_rate`).
fn spi_divider(kernel_hz: u64, wanted_hz: u64) -> u64 {
    match kernel_hz / wanted_hz {
        0..=2 => 2,
        3..=5 => 4,
        6..=11 => 8,
        12..=23 => 16,
        24..=39 => 32,
        40..=95 => 64,
        96..=191 => 128,
        _ => 256,
    }
}

/// Tells whether a rate stands in a text, and not as the end of another number.
fn stands_in(text: &str, rate: &str) -> bool {
    text.match_indices(rate).any(|(at, _)| {
        !text[..at].ends_with(|letter: char| letter.is_ascii_digit() || letter == '.')
    })
}

#[test]
fn the_clocks_are_those_of_the_code() {
    let clocks = format!("{BOARD}/clocks.rs");
    let hse = number_after(&clocks, "freq: Hertz::mhz(");
    let input = hse / number_after(&clocks, "PllPreDiv::DIV");
    let pll = input * number_after(&clocks, "PllMul::MUL");
    let core = pll / number_after(&clocks, "PllRDiv::DIV");
    let can = pll as f64 / number_after(&clocks, "PllQDiv::DIV") as f64;
    let pwm = number_after(&format!("{BOARD}/bridges.rs"), "Hertz::khz(");
    let wanted = number_after(
        &format!("{BOARD}/sensors.rs"),
        "config.frequency = Hertz::mhz(",
    );
    let divider = spi_divider(core * 1_000_000, wanted * 1_000_000);
    let spi = core as f64 / divider as f64;
    let expected = [
        ("HSE", format!("{hse} MHz")),
        ("PLL input", format!("{input} MHz")),
        ("PLL", format!("{pll} MHz")),
        ("SYSCLK, core, AHB", format!("{core} MHz")),
        ("APB1, APB2, all timers", format!("{core} MHz")),
        ("FDCAN1", format!("{can} MHz")),
        ("ADC1, ADC2", format!("{} MHz", core as f64 / 4.0)),
        ("PWM and current conversion", format!("{pwm} kHz")),
        ("SPI1", format!("{spi} MHz")),
    ];
    let page = text(PAGE);
    let picture = text("docs/images/clock-tree.svg");
    let rows = table(&page, "| clock | from |");
    let mut found = Vec::new();
    for (clock, rate) in &expected {
        let row = rows.iter().find(|row| row[0] == *clock);
        let written = row.map_or("nothing", |row| row[2]);
        if written != rate {
            found.push(format!(
                "{clock} runs at {rate} by the code and at {written} in {PAGE}: write {rate} there"
            ));
        }
        if !stands_in(&picture, rate) {
            found.push(format!("clock-tree.svg lacks {rate} of {clock}: add it"));
        }
    }
    expect_none(&found);
}

#[test]
fn the_priorities_are_those_that_the_code_sets() {
    let code = board_code();
    let mut set: Vec<(&str, &str)> = Vec::new();
    for (at, _) in code.match_indices(".set_priority(Priority::P") {
        let before = code[..at].rsplit("::").next().unwrap_or_default();
        let after = &code[at..][".set_priority(Priority::P".len()..];
        set.push((before, after.split(')').next().unwrap_or_default()));
    }
    assert_eq!(
        set.len(),
        7,
        "the board sets other priorities than seven: change this test"
    );
    let page = text(PAGE);
    let mut found = Vec::new();
    let rows = table(&page, "| priority | interrupt |");
    for (interrupt, priority) in &set {
        let row = rows.iter().find(|row| row[1] == *interrupt);
        let written = row.map_or("none", |row| row[0]);
        if written != *priority {
            found.push(format!(
                "{interrupt} has priority {priority} in {BOARD} and {written} in {PAGE}: write {priority}"
            ));
        }
    }
    for row in rows.iter().filter(|row| row[3] == "not set") {
        if set.iter().any(|(interrupt, _)| row[1].contains(interrupt)) {
            found.push(format!("{} is set by the code: say so in {PAGE}", row[1]));
        }
    }
    expect_none(&found);
}
