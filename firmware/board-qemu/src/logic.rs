//! The logic crates alone, linked for the target: `cargo xtask panics` looks for panics in it.
//!
//! It is never run. Its inputs are unknown to the compiler and its outputs are used, so that nothing
//! of a vertebra is left out; what a panic would need is linked only if one can be reached.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod image {
    use core::hint::black_box;
    use core::panic::PanicInfo;

    use eel_protocol::NodeId;
    use eel_vertebra::{Settings, Vertebra, lockstep, turn};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        let now = black_box(eel_units::Instant::ZERO);
        let Some(node) = NodeId::new(black_box(1)) else {
            cortex_m::asm::udf();
        };
        let mut vertebra = Vertebra::new(black_box(Settings::prototype(node, 1)), now);
        loop {
            if let Ok(input) = lockstep::Input::decode(black_box(&[])) {
                take_turn(&mut vertebra, input);
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
        } = input;
        let drives = turn(vertebra, now, heard, &sample, |frame| {
            black_box(frames.push(frame).is_ok());
        });
        black_box(
            lockstep::Output {
                drives,
                frames,
                lost: 0,
            }
            .encode()
            .as_bytes(),
        );
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
        vertebra.note_loop_time(black_box(eel_units::Duration::ZERO));
        vertebra.note_overruns(black_box(0), black_box(0));
        while let Some(event) = vertebra.poll_event() {
            black_box(event);
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
