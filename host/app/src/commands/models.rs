//! `models`: what models there are, and whether their files are what their manifests say. Runs no network.

use std::path::{Path, PathBuf};

use physvideo_net::{CheckLine, LibraryChoice, Manifest, NetError, Role, Runtime, Status, check_folder};

use super::print;
use crate::cli::ModelsCommand;
use crate::error::AppError;

/// Name of a manifest.
const MANIFEST: &str = "model.toml";

pub(super) fn models(command: ModelsCommand) -> Result<(), AppError> {
    match command {
        ModelsCommand::List { folders } => list(&folders),
        ModelsCommand::Check { folders, ort_lib, provider } => check(
            &folders,
            &LibraryChoice { path: ort_lib, provider: provider.map(Into::into).unwrap_or_default(), threads: None },
        ),
    }
}

fn list(named: &[PathBuf]) -> Result<(), AppError> {
    let folders = folders(named)?;
    let mut bad = 0;
    for folder in &folders {
        match Manifest::read(folder) {
            Ok(manifest) => {
                let roles = Role::ALL.into_iter().filter(|role| manifest.role(*role).is_some());
                let roles: Vec<_> = roles.map(Role::name).collect();
                let (here, all) =
                    (manifest.files().filter(|f| folder.join(&f.file).is_file()).count(), manifest.files().count());
                print(&format!(
                    "{}  {}, {} frames a chunk, {here} of {all} files here  {}",
                    manifest.name,
                    roles.join(" + "),
                    manifest.chunk.frames,
                    folder.display()
                ));
                if !manifest.description.is_empty() {
                    print(&format!("    {}", manifest.description.trim()));
                }
            }
            Err(e) => {
                bad += 1;
                print(&format!("{}  cannot be used\n{}", folder.display(), indented(&e.to_string())));
            }
        }
    }
    finish(bad, folders.len())
}

fn check(named: &[PathBuf], choice: &LibraryChoice) -> Result<(), AppError> {
    let folders = folders(named)?;
    let runtime = match Runtime::load(choice) {
        Ok(runtime) => {
            print(&format!("ONNX Runtime {} at {}", runtime.version(), runtime.path().display()));
            Ok(runtime)
        }
        // The rest can be looked at without it.
        Err(e) => {
            print(&format!("no ONNX Runtime: {e}"));
            Err(e)
        }
    };
    let mut bad = 0;
    for folder in &folders {
        let lines = check_folder(runtime.as_ref().ok(), folder);
        // A model that was named is meant to be used.
        let is_bad =
            |line: &CheckLine| line.status == Status::Bad || (line.status == Status::Absent && !named.is_empty());
        bad += usize::from(lines.iter().any(is_bad));
        print(&folder.display().to_string());
        for line in &lines {
            match line.status {
                Status::Absent if named.is_empty() => print("    absent  none of its files is here"),
                _ => print(&indented(&told(line))),
            }
        }
    }
    finish(bad, folders.len())?;
    runtime.map(|_| ()).map_err(AppError::Net)
}

fn told(line: &CheckLine) -> String {
    let status = match line.status {
        Status::Good => "ok     ",
        Status::Warning => "note   ",
        Status::Bad => "bad    ",
        Status::Absent => "absent ",
    };
    let role = line.role.map_or(String::new(), |role| format!("{}: ", role.name()));
    format!("{status} {role}{}", line.text)
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("    {line}")).collect::<Vec<_>>().join("\n")
}

fn finish(bad: usize, all: usize) -> Result<(), AppError> {
    if bad == 0 { Ok(()) } else { Err(AppError::Models { bad, all }) }
}

/// The folders of models: those named, and those inside a named folder that is none itself.
fn folders(named: &[PathBuf]) -> Result<Vec<PathBuf>, AppError> {
    let mut found = Vec::new();
    if named.is_empty() {
        let here = std::env::current_dir().map_err(|e| AppError::Internal(format!("no current folder: {e}")))?;
        let near = here.ancestors().map(|f| f.join("assets/models")).find(|f| f.is_dir());
        let near =
            near.ok_or_else(|| AppError::Usage("no folder assets/models is near: name the folder of a model".into()))?;
        return inside(near.strip_prefix(&here).unwrap_or(&near));
    }
    for folder in named {
        if folder.join(MANIFEST).is_file() || folder.is_file() {
            found.push(folder.clone());
        } else if folder.is_dir() {
            found.extend(inside(folder)?);
        } else {
            return Err(NetError::MissingFile { path: folder.clone(), obtain: String::new() }.into());
        }
    }
    Ok(found)
}

fn inside(folder: &Path) -> Result<Vec<PathBuf>, AppError> {
    let told = |e: std::io::Error| AppError::Usage(format!("{}: {e}", folder.display()));
    let entries = std::fs::read_dir(folder).map_err(told)?.collect::<Result<Vec<_>, _>>().map_err(told)?;
    let mut found: Vec<_> = entries.into_iter().map(|e| e.path()).filter(|p| p.join(MANIFEST).is_file()).collect();
    found.sort();
    if found.is_empty() {
        return Err(AppError::Usage(format!("{}: no folder in it has a {MANIFEST}", folder.display())));
    }
    Ok(found)
}
