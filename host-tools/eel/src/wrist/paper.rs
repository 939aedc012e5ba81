//! `eel wrist paper`: every claim of the paper, printed and computed.

mod claims;
mod errata;

use std::io::Write;

use anyhow::Result;
use serde::Serialize;

/// What became of a claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Verdict {
    /// The computed value is the printed one.
    Holds,
    /// The paper errs, and the computation shows it.
    Erratum,
    /// Neither: our computation and what we know disagree.
    Fails,
}

/// One claim of the paper.
#[derive(Debug, Serialize)]
struct Claim {
    source: &'static str,
    claim: String,
    printed: String,
    computed: String,
    verdict: Verdict,
    /// The number of the erratum in docs/wrist.md.
    erratum: Option<u8>,
}

/// Writes the table, and returns how many claims fail.
pub fn run(out: &mut dyn Write, json: bool) -> Result<u64> {
    let mut all = claims::all();
    all.extend(errata::all());
    let count = |verdict| all.iter().filter(|claim| claim.verdict == verdict).count();
    let fails = count(Verdict::Fails);
    if json {
        serde_json::to_writer_pretty(&mut *out, &all)?;
        writeln!(out)?;
        return Ok(fails as u64);
    }
    let wide = |pick: fn(&Claim) -> &str| {
        all.iter()
            .map(|c| pick(c).chars().count())
            .max()
            .unwrap_or(0)
    };
    let (source, name) = (wide(|claim| claim.source), wide(|claim| &claim.claim));
    let (printed, computed) = (wide(|claim| &claim.printed), wide(|claim| &claim.computed));
    let mut line = |cells: [&str; 5]| {
        let [a, b, c, d, e] = cells;
        writeln!(
            out,
            "{a:<source$}  {b:<name$}  {c:<printed$}  {d:<computed$}  {e}"
        )
    };
    line(["source", "claim", "printed", "computed", "verdict"])?;
    for claim in &all {
        let verdict = match (claim.verdict, claim.erratum) {
            (Verdict::Holds, _) => "holds".to_owned(),
            (Verdict::Erratum, number) => format!("erratum {}", number.unwrap_or(0)),
            (Verdict::Fails, _) => "FAILS".to_owned(),
        };
        line([
            claim.source,
            &claim.claim,
            &claim.printed,
            &claim.computed,
            &verdict,
        ])?;
    }
    writeln!(
        out,
        "\n{} claims: {} hold, {} are errata (docs/wrist.md), {fails} fail",
        all.len(),
        count(Verdict::Holds),
        count(Verdict::Erratum),
    )?;
    Ok(fails as u64)
}
