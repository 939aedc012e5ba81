//! A perceptually uniform sequential colour map, dark to light: viridis (matplotlib, CC0).

/// Viridis at equal steps from 0 to 1, sRGB.
const STOPS: [[u8; 3]; 11] = [
    [0x44, 0x01, 0x54],
    [0x48, 0x24, 0x75],
    [0x41, 0x44, 0x87],
    [0x35, 0x5f, 0x8d],
    [0x2a, 0x78, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x22, 0xa8, 0x84],
    [0x44, 0xbf, 0x70],
    [0x7a, 0xd1, 0x51],
    [0xbd, 0xdf, 0x26],
    [0xfd, 0xe7, 0x25],
];

/// Returns the colour of a share, 0 to 1, as SVG writes it; shares beyond are the ends'.
pub fn viridis(share: f64) -> String {
    let [r, g, b] = mixed(share);
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Mixes the two stops that a share is between.
fn mixed(share: f64) -> [u8; 3] {
    let place = share.clamp(0.0, 1.0) * (STOPS.len() - 1) as f64;
    let below = (place as usize).min(STOPS.len() - 2);
    let part = place - below as f64;
    [0, 1, 2].map(|k| {
        let (low, high) = (f64::from(STOPS[below][k]), f64::from(STOPS[below + 1][k]));
        (low + (high - low) * part).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG) of an sRGB colour.
    fn luminance(colour: [u8; 3]) -> f64 {
        let linear = colour.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.04045 {
                part / 12.92
            } else {
                ((part + 0.055) / 1.055).powf(2.4)
            }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn lightness_grows_evenly_with_the_number() {
        // L* of CIE 1976: viridis rises from 15 to 91 in equal steps.
        let lightness = |k: i32| 116.0 * luminance(mixed(f64::from(k) / 20.0)).cbrt() - 16.0;
        for k in 1..=20 {
            let step = lightness(k) - lightness(k - 1);
            assert!((2.0..=5.5).contains(&step), "step {k}: {step}");
        }
    }

    #[test]
    fn the_ends_hold_beyond_the_range() {
        assert_eq!([viridis(-1.0), viridis(0.0)], ["#440154", "#440154"]);
        assert_eq!([viridis(1.0), viridis(7.0)], ["#fde725", "#fde725"]);
    }
}
