//! Whether a file is a whole shared library of this machine. Loads nothing.
//!
//! The system's loader maps a file that was cut short, and the process dies at its first missing page.

use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Most program headers a library has.
const MOST_HEADERS: usize = 1024;

/// Says what is wrong with a file, if it is no whole library.
pub(super) fn check(path: &Path) -> Result<(), String> {
    let metadata = path.metadata().map_err(|e| e.to_string())?;
    if !metadata.is_file() {
        return Err("it is not a file".into());
    }
    if !cfg!(target_os = "linux") {
        return Ok(());
    }
    let mut file = File::open(path).map_err(|e| e.to_string())?;
    let mut head = Vec::new();
    // Headers stand at the front; 1 MiB has room for the most there may be.
    file.by_ref().take(1 << 20).read_to_end(&mut head).map_err(|e| e.to_string())?;
    whole(&head, metadata.len())
}

fn whole(head: &[u8], size: u64) -> Result<(), String> {
    const CUT: &str = "it is cut short";
    if !head.starts_with(b"\x7fELF") {
        return Err("it is not a shared library".into());
    }
    let machine: u16 = if cfg!(target_arch = "x86_64") {
        62
    } else if cfg!(target_arch = "aarch64") {
        183
    } else {
        0
    };
    let fits = (|| {
        let shared = number::<2>(head, 16)? == 3;
        let ours = machine == 0 || number::<2>(head, 18)? == u64::from(machine);
        Some(head.get(4..6)? == [2, 1] && shared && ours)
    })();
    if !fits.ok_or(CUT)? {
        return Err("it is not a shared library for this machine".into());
    }
    let complete = (|| {
        let (start, length) = (number::<8>(head, 32)?, number::<2>(head, 54)?);
        let headers = number::<2>(head, 56)?;
        if headers as usize > MOST_HEADERS || length < 56 {
            return None;
        }
        for i in 0..headers {
            let at = usize::try_from(start.checked_add(i * length)?).ok()?;
            let end = number::<8>(head, at.checked_add(8)?)?.checked_add(number::<8>(head, at.checked_add(32)?)?)?;
            if number::<4>(head, at)? == 1 && end > size {
                return None;
            }
        }
        let sections = number::<8>(head, 40)?;
        let end = sections.checked_add(number::<2>(head, 58)? * number::<2>(head, 60)?)?;
        (sections == 0 || end <= size).then_some(())
    })();
    complete.ok_or_else(|| CUT.into())
}

/// A little-endian number of `N` bytes.
fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<u64> {
    let bytes = bytes.get(at..at.checked_add(N)?)?;
    Some(bytes.iter().rev().fold(0, |n, &b| n << 8 | u64::from(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_libraries_are_told_from_other_files() {
        let ours = std::env::current_exe().unwrap();
        let bytes = std::fs::read(&ours).unwrap();
        let size = bytes.len() as u64;
        // Test programs are position-independent, which looks like a library.
        whole(&bytes, size).unwrap();
        assert_eq!(whole(&bytes, size - 1).unwrap_err(), "it is cut short");
        assert_eq!(whole(&bytes[..40], 40).unwrap_err(), "it is cut short");
        assert_eq!(whole(b"#!/bin/sh", 9).unwrap_err(), "it is not a shared library");
        for at in 0..64 {
            let mut bytes = bytes[..4096].to_vec();
            bytes[at] ^= 0xff;
            let _ = whole(&bytes, size);
        }
        assert!(check(Path::new("/")).unwrap_err().contains("not a file"));
    }
}
