//! Compresses a text into a grammar that a vertebra expands without memory to speak of.
//!
//! The pair of neighbours that is most frequent becomes a rule, again and again, until no pair comes
//! three times (Re-Pair, N. J. Larsson and A. Moffat, 1999). The layout is that of
//! [`eel_protocol::eds`].

use std::collections::BTreeMap;

use anyhow::{Result, ensure};
use eel_protocol::eds::{DEPTH, Grammar, Reader};

/// A pair that comes less often saves nothing: its rule takes two codes itself.
const WORTHWHILE: usize = 3;

/// The pairs in the order in which they became rules, and what is left of the text.
struct Rules {
    characters: Vec<u8>,
    rules: Vec<(u16, u16)>,
    symbols: Vec<u16>,
}

/// Returns the grammar of a text.
///
/// # Errors
/// When the text is too long or too deep for the layout, or does not come back from it.
pub fn compress(text: &[u8]) -> Result<Vec<u8>> {
    let Rules {
        characters,
        rules,
        symbols,
    } = find(text)?;
    let highest = characters.len() + rules.len() - 1;
    // A text of one character has codes too.
    let width = (usize::BITS - highest.leading_zeros()).max(1);
    ensure!(width <= 16, "{} rules are too many", rules.len());
    let mut bytes = Vec::new();
    bytes.extend(u32::try_from(text.len())?.to_le_bytes());
    bytes.push(u8::try_from(characters.len())?);
    bytes.extend(u16::try_from(rules.len())?.to_le_bytes());
    bytes.extend(u16::try_from(symbols.len())?.to_le_bytes());
    bytes.push(width as u8);
    bytes.extend(&characters);
    let codes = rules.iter().flat_map(|(first, second)| [*first, *second]);
    bytes.extend(pack(codes.chain(symbols.iter().copied()), width));
    let mut back = vec![0; text.len() + 1];
    let count = Grammar::new(&bytes).map(|grammar| Reader::default().read(&grammar, 0, &mut back));
    ensure!(
        count.is_some_and(|count| back[..count] == *text),
        "the text does not come back from its grammar: rules deeper than {DEPTH}?"
    );
    Ok(bytes)
}

/// Replaces pairs by rules until none is worth it.
fn find(text: &[u8]) -> Result<Rules> {
    let mut characters = text.to_vec();
    characters.sort_unstable();
    characters.dedup();
    ensure!(!characters.is_empty(), "there is no text");
    let code = |byte: &u8| characters.binary_search(byte).unwrap_or_default() as u16;
    let mut symbols: Vec<u16> = text.iter().map(code).collect();
    let mut rules: Vec<(u16, u16)> = Vec::new();
    while let Some(pair) = most_frequent(&symbols) {
        let rule = u16::try_from(characters.len() + rules.len())?;
        symbols = replace(&symbols, pair, rule);
        rules.push(pair);
    }
    Ok(Rules {
        characters,
        rules,
        symbols,
    })
}

/// Returns the pair that comes most often without overlapping itself; of several the first in order.
fn most_frequent(symbols: &[u16]) -> Option<(u16, u16)> {
    let mut counts: BTreeMap<(u16, u16), (usize, usize)> = BTreeMap::new();
    for (place, pair) in symbols.windows(2).enumerate() {
        let (count, free_from) = counts.entry((pair[0], pair[1])).or_default();
        if place >= *free_from {
            *count += 1;
            *free_from = place + 2;
        }
    }
    counts
        .into_iter()
        .filter(|(_, (count, _))| *count >= WORTHWHILE)
        .max_by_key(|(pair, (count, _))| (*count, std::cmp::Reverse(*pair)))
        .map(|(pair, _)| pair)
}

/// Puts a rule in the place of every pair.
fn replace(symbols: &[u16], pair: (u16, u16), rule: u16) -> Vec<u16> {
    let mut replaced = Vec::with_capacity(symbols.len());
    let mut rest = symbols;
    while let [first, others @ ..] = rest {
        rest = match others {
            [second, others @ ..] if (*first, *second) == pair => {
                replaced.push(rule);
                others
            }
            _ => {
                replaced.push(*first);
                others
            }
        };
    }
    replaced
}

/// Puts codes of `width` bits one behind the other, lowest bit first.
fn pack(codes: impl Iterator<Item = u16>, width: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let (mut bits, mut held) = (0_u32, 0);
    for code in codes {
        bits |= u32::from(code) << held;
        held += width;
        while held >= 8 {
            bytes.push(bits as u8);
            bits >>= 8;
            held -= 8;
        }
    }
    if held > 0 {
        bytes.push(bits as u8);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_come_back() {
        for text in [
            &b"a"[..],
            b"abcabcabcabc",
            b"aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa",
            b"no pair of this text comes three times",
        ] {
            let bytes = compress(text).unwrap();
            let grammar = Grammar::new(&bytes).unwrap();
            assert_eq!(grammar.length() as usize, text.len());
        }
        assert!(compress(b"").is_err());
    }

    #[test]
    fn a_text_that_repeats_itself_shrinks() {
        let text = b"[2010sub1]\nParameterName=pose.yaw\n".repeat(100);
        assert!(compress(&text).unwrap().len() < 120);
    }
}
