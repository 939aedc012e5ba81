//! Small functions as llvm-objdump prints them.

use super::*;

/// Reads one function from its instructions.
fn body(code: &str) -> Result<Body> {
    let mut text = "08000100 <it>:\n".to_owned();
    for line in code.lines() {
        text.push_str(&format!(
            " 8000100:      \t{}\n",
            line.trim().replacen(' ', "\t", 1)
        ));
    }
    Ok(read(&text, &BTreeMap::new())?
        .remove(&0x0800_0100)
        .expect("one function"))
}

#[test]
fn reads_calls_jumps_and_pushes() {
    let body = body(
        "push.w {r4, r6, r7, r8, lr}
         vpush {d8-d10}
         sub sp, #0x18
         str r3, [sp, #-8]!
         cbz r3, 0x8000120 <it+0x20> @ imm = #0x18
         bmi.w 0x800074c <<a as b>::c+0x10c> @ imm = #0xb8
         bl 0x8000300 <other> @ imm = #0x9d1e
         addw sp, sp, #0x14
         b.w 0x8000400 <last>",
    )
    .unwrap();
    assert_eq!(body.pushed, 20 + 24 + 24 + 8);
    assert_eq!(body.calls, BTreeSet::from([0x0800_0300]));
    assert_eq!(
        body.jumps,
        BTreeSet::from([0x0800_0120, 0x0800_074c, 0x0800_0400])
    );
    assert!(!body.calls_indirectly && !body.falls_through);
}

#[test]
fn names_lose_their_hash_and_lines_beside_the_code_are_none() {
    let text = "image.elf:\tfile format elf32-littlearm\n\nDisassembly of section .text:\n\n\
                08000010 <<a::B as c::D>::e::h0123456789abcdef>:\n 8000010:      \tbx\tlr\n";
    let bodies = read(text, &BTreeMap::new()).unwrap();
    assert_eq!(bodies.len(), 1);
    assert_eq!(bodies[&0x0800_0010].name, "<a::B as c::D>::e");
}

#[test]
fn finds_calls_of_what_is_in_a_register() {
    for code in [
        "blx r3",
        "bx r12",
        "blxne r1",
        "ldr pc, [r0, #4]",
        "ldr.w pc, [r2]",
    ] {
        assert!(body(code).unwrap().calls_indirectly, "{code}");
    }
    for code in [
        "bx lr",
        "bxeq lr",
        "pop {r4, pc}",
        "popne {r7, pc}",
        "ldr pc, [sp], #4",
        "tbb [pc, r0]",
        "mov pc, r6\nnop\nb.w 0x8000288 <it+0x10>",
    ] {
        assert!(!body(code).unwrap().calls_indirectly, "{code}");
    }
}

#[test]
fn tells_conditions_from_other_names_that_begin_with_b() {
    let body =
        body("bls 0x8000110 <it+0x10>\nbic r0, r0, #1\nbfi r0, r1, #0, #4\nbl 0x8000300 <a>");
    let body = body.unwrap();
    assert_eq!(body.jumps, BTreeSet::from([0x0800_0110]));
    assert_eq!(body.calls, BTreeSet::from([0x0800_0300]));
}

#[test]
fn joins_the_halves_of_an_address_and_reads_words_between_the_code() {
    let code = "movw r0, #0x4f1\nmovw r1, #0x10\nmovt r0, #0x800\nmovt r2, #0x801\nbx lr\n.word 0x08000301";
    let words = body(code).unwrap().words;
    assert_eq!(words, BTreeSet::from([0x0800_0301, 0x0800_04f1]));
}

#[test]
fn knows_who_goes_on_into_the_next_function() {
    for (code, goes_on) in [
        ("adds r0, #1", true),
        ("beq 0x8000110 <it+0x10>", true),
        ("bx lr\nnop", false),
        ("bl 0x8000300 <stops>", false),
        ("udf #0xfe\n.word 0x1", false),
    ] {
        assert_eq!(body(code).unwrap().falls_through, goes_on, "{code}");
    }
}

#[test]
fn refuses_what_it_cannot_follow() {
    for code in [
        "sub.w sp, sp, r4",
        "mov sp, r7",
        "mov pc, r6\nadds r0, #1",
        "bl somewhere",
    ] {
        assert!(body(code).is_err(), "{code}");
    }
}

#[test]
fn what_the_linker_fills_in_behind_a_function_is_none_of_it() {
    let text = "08000942 <it>:\n 8000942:      \tbx\tlr\n 8000944:      \tbmi\t0x80008f0 <x>\n";
    let size = |bytes| BTreeMap::from([(0x0800_0942, bytes)]);
    assert!(read(text, &size(2)).unwrap()[&0x0800_0942].jumps.is_empty());
    assert_eq!(read(text, &size(4)).unwrap()[&0x0800_0942].jumps.len(), 1);
}
