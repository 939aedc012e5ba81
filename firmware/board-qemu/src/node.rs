//! The CANopen node and the dictionary alone, linked for the target: `cargo xtask cycles` weighs it
//! against `bare`.
//!
//! It is never run. Its inputs are unknown to the compiler and its outputs are used, so that nothing of
//! the node is left out. Node and application lie in variables of their own, so that the image's RAM is
//! theirs.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod values;

#[cfg(target_os = "none")]
mod image {
    use core::hint::black_box;
    use core::mem::MaybeUninit;
    use core::panic::PanicInfo;

    use eel_canopen::{Abort, Event, Frame, Node};

    use crate::values::{Values, vertebra};

    #[cortex_m_rt::entry]
    fn main() -> ! {
        static mut APP: Values = Values::new();
        // Not an option: its initial value would lie in flash.
        static mut NODE: MaybeUninit<Node> = MaybeUninit::uninit();
        let stored = black_box::<&[u8]>(&[]);
        let node = NODE.write(Node::new(vertebra(black_box(5)), stored, APP, black_box(0)));
        loop {
            serve(node, APP);
        }
    }

    /// Does everything that a platform can ask of a node.
    fn serve(node: &mut Node, app: &mut Values) {
        let now_us = black_box(1_000);
        if let Some(frame) = Frame::standard(black_box(0x605), black_box(&[])) {
            node.handle_frame(now_us, &frame, app);
        }
        node.tick(now_us, app);
        while let Some(frame) = node.poll_transmit() {
            black_box(frame);
        }
        while let Some(event) = node.poll_event() {
            if let Event::Store(_) = event {
                let parameters = black_box::<&mut [u8]>(&mut []);
                black_box(node.save_parameters(parameters));
                let outcome = if black_box(true) {
                    Ok(black_box::<&[u8]>(&[]))
                } else {
                    Err(Abort::Hardware)
                };
                node.finish_store(now_us, outcome);
            }
            black_box(event);
        }
        if black_box(false) {
            node.emergency(now_us, black_box(0x1000), black_box(1), black_box([0; 5]));
        }
        if black_box(false) {
            node.emergency_cleared(now_us, black_box(1));
        }
        node.request_tpdo(black_box(1));
        black_box((node.nmt_state(), node.node_id(), node.error_register()));
        black_box(node.counters());
    }

    #[panic_handler]
    fn panic(_: &PanicInfo) -> ! {
        cortex_m::asm::udf();
    }
}

/// Says what this is for: it is only linked.
#[cfg(not(target_os = "none"))]
fn main() {
    println!("cargo xtask cycles");
}
