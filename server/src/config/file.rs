//! A file of settings, laid under the command line: each value becomes the default of the option of its name, so that it is read by the same
//! parser and is refused in the same words.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::{CommandFactory as _, Error, FromArgMatches as _};
use toml::{Table, Value};

use super::CommandLine;

/// The one setting that a file cannot hold.
const CONFIG: &str = "config";

/// The one subcommand that has settings.
const SERVE: &str = "serve";

impl CommandLine {
    /// Reads the words of a command line, the environment, and the file that one of them names.
    ///
    /// # Errors
    /// What is wrong, in words, with clap's exit codes.
    pub fn read(words: impl IntoIterator<Item = impl Into<OsString>>) -> Result<Self, Error> {
        let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
        let first = Self::command().try_get_matches_from(&words)?;
        if first.subcommand_name().is_some_and(|name| name != SERVE) {
            return Self::from_arg_matches(&first);
        }
        let of_serve = first.subcommand_matches(SERVE);
        let named = |id: &str| of_serve.unwrap_or(&first).try_get_one::<PathBuf>(id).ok().flatten().cloned();
        let Some(path) = named(CONFIG) else { return Self::from_arg_matches(&first) };
        let settings = settings(&path).map_err(|reason| fault(&path, &reason))?;
        let command = under(Self::command(), &settings).mut_subcommand(SERVE, |serve| under(serve, &settings));
        let matches = command.try_get_matches_from(&words).map_err(|error| match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => error,
            // The words alone were in order.
            _ => fault(&path, &error.to_string()),
        })?;
        Self::from_arg_matches(&matches)
    }
}

fn fault(path: &Path, reason: &str) -> Error {
    CommandLine::command().error(ErrorKind::ValueValidation, format!("{}: {reason}", path.display()))
}

/// The settings in the file: option names with the texts of their values.
fn settings(path: &Path) -> Result<Vec<(String, Vec<String>)>, String> {
    let text = fs::read_to_string(path).map_err(|error| error.to_string())?;
    let table: Table = text.parse().map_err(|error: toml::de::Error| error.to_string())?;
    let command = CommandLine::command();
    let known: Vec<&str> = command.get_arguments().filter_map(|argument| argument.get_long()).collect();
    let known: Vec<&str> = known.into_iter().filter(|name| ![CONFIG, "help", "version"].contains(name)).collect();
    let mut settings = Vec::new();
    for (name, value) in table {
        if !known.contains(&name.as_str()) {
            return Err(format!("there is no setting {name:?}; known are {}", known.join(", ")));
        }
        let texts = match &value {
            Value::Array(items) => items.iter().map(|item| word(&name, item)).collect::<Result<_, _>>()?,
            single => vec![word(&name, single)?],
        };
        settings.push((name, texts));
    }
    Ok(settings)
}

/// The text that stands for a value on a command line.
fn word(name: &str, value: &Value) -> Result<String, String> {
    match value {
        Value::String(text) => Ok(text.clone()),
        Value::Integer(number) => Ok(number.to_string()),
        Value::Float(number) => Ok(number.to_string()),
        Value::Boolean(truth) => Ok(truth.to_string()),
        _ => Err(format!("{name} is text, a number or a list of texts")),
    }
}

/// The command with the settings as defaults of its options.
fn under(command: clap::Command, settings: &[(String, Vec<String>)]) -> clap::Command {
    command.mut_args(|argument| {
        let name = argument.get_long().map(str::to_owned);
        match settings.iter().find(|(known, _)| Some(known) == name.as_ref()) {
            Some((_, texts)) => argument.default_values(texts),
            None => argument,
        }
    })
}
