//! Runs inputs through a fuzz target, without libFuzzer, and packs and unpacks its committed inputs.

use std::path::Path;
use std::process::ExitCode;

use eel_fuzz::{TARGETS, Target, corpus};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let known = |name: &str| TARGETS.iter().find(|target| target.name == name);
    let Some((target, words)) = words
        .split_first()
        .and_then(|(name, words)| Some((known(name)?, words)))
        .filter(|(_, words)| !words.is_empty())
    else {
        let names = TARGETS.map(|target| target.name).join("|");
        eprintln!(
            "usage: eel-fuzz {names} FILE… | --base64 TEXT | --unpack FOLDER | --pack FOLDER"
        );
        return ExitCode::FAILURE;
    };
    match run(target, words) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Does what the words say; a broken promise ends the program with its words.
fn run(target: &Target, words: &[&str]) -> Result<(), String> {
    let name = target.name;
    match words {
        ["--unpack", folder] => {
            corpus::unpack(name, Path::new(folder)).map_err(|error| error.to_string())
        }
        ["--pack", folder] => {
            let count = corpus::pack(name, Path::new(folder)).map_err(|error| error.to_string())?;
            println!("{name}: {count} inputs");
            Ok(())
        }
        ["--base64", text] => {
            let data = corpus::decode(text).ok_or_else(|| format!("{text} is not base64"))?;
            (target.run)(&data);
            println!("{name}: every promise kept");
            Ok(())
        }
        paths => {
            for path in paths {
                let data = std::fs::read(path).map_err(|error| format!("{path}: {error}"))?;
                (target.run)(&data);
                println!("{name}: {path}: every promise kept");
            }
            Ok(())
        }
    }
}
