//! The logic crates alone, linked for the target: `cargo xtask panics` looks for panics in it.
//!
//! It is never run. Its inputs are unknown to the compiler and its outputs are used, so that nothing
//! of a vertebra is left out; what a panic would need is linked only if one can be reached.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod image {
    use core::hint::black_box;
    use core::panic::PanicInfo;

    use eel_head::{Config, Gait, Head, Plane};
    use eel_protocol::{Frame, NodeId};
    use eel_vertebra::store::{self, RamFlash, Store};
    use eel_vertebra::{KEEPSAKE_BYTES, Keepsake, Settings, Vertebra, lockstep, turn};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let now = black_box(eel_units::Instant::ZERO);
        let Some(node) = NodeId::new(black_box(1)) else {
            cortex_m::asm::udf();
        };
        let mut store = black_box(Store::new(RamFlash::new()));
        let settings = black_box(Settings::prototype(node, 1));
        let mut vertebra = Vertebra::with_stored(settings, &store.load(), now);
        if black_box(false) {
            vertebra.stop_after_failure(&Keepsake::from_bytes(black_box([0; KEEPSAKE_BYTES])));
        }
        let (amplitude, wavelength) = black_box((800, 8_000));
        let Ok(gait) = Gait::new(
            black_box(1_000),
            amplitude,
            wavelength,
            black_box(Plane::Lateral),
        ) else {
            cortex_m::asm::udf();
        };
        let mut head = Head::new(black_box(Config::new(gait)), now);
        loop {
            if let Some(frame) = Frame::standard(black_box(0x701), black_box(&[5])) {
                lead(&mut head, black_box(now), &frame);
            }
            if let Ok(input) = lockstep::Input::decode(black_box(&[])) {
                take_turn(&mut vertebra, input);
                store::serve(&mut vertebra, &mut store, black_box(now));
            }
        }
    }

    /// Does everything that a platform can ask of a vertebra.
    fn take_turn(vertebra: &mut Vertebra, input: lockstep::Input) {
        let mut frames = lockstep::Frames::new();
        let lockstep::Input {
            now,
            sample,
            frames: heard,
            room,
        } = input;
        let heard = heard.iter().copied();
        let drives = turn(vertebra, now, heard, &sample, room.into(), |frame| {
            black_box(frames.push(frame).is_ok());
        });
        let trim_ns = vertebra.tick_trim_ns();
        let made = lockstep::Output {
            drives,
            trim_ns,
            chain_out: vertebra.chain_out(),
            frames,
        };
        black_box(made.encode().as_bytes());
        black_box((
            vertebra.state(),
            vertebra.status(),
            vertebra.pose(),
            vertebra.reference(),
        ));
        black_box((
            vertebra.motor_angles(),
            vertebra.nmt_state(),
            vertebra.node_id(),
        ));
        black_box(vertebra.poll_keepsake().as_ref().map(Keepsake::as_bytes));
        vertebra.note_loop_time(black_box(eel_units::Duration::ZERO));
        vertebra.note_overruns(black_box(0), black_box(0));
        while let Some(event) = vertebra.poll_event() {
            black_box(event);
        }
    }

    /// Does everything that a platform can ask of a head.
    fn lead(head: &mut Head, now: eel_units::Instant, frame: &Frame) {
        head.handle_frame(now, frame);
        head.tick(now);
        while let Some(frame) = head.poll_transmit() {
            black_box(frame);
        }
        while let Some(event) = head.poll_event() {
            black_box(event);
        }
        if black_box(false) {
            head.stop(now);
        }
        if black_box(false) {
            head.reset();
        }
        for id in NodeId::all() {
            black_box((head.node(id), head.running()));
        }
    }

    #[panic_handler]
    fn panic(_: &PanicInfo) -> ! {
        panic_reached()
    }

    /// Has a name of its own that inlining can't take away.
    #[inline(never)]
    fn panic_reached() -> ! {
        loop {
            cortex_m::asm::udf();
        }
    }
}

/// Says what to do: the image is only looked at.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("cargo xtask panics");
}
