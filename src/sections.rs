//! A file of named sections of bytes, with a SHA-256 at its end: whole, or known not to be.

use std::{
    collections::BTreeMap,
    io::{self, BufWriter, Write},
    path::Path,
};

use sha2::{Digest, Sha256};

use crate::atomic_file;

/// What the file begins with.
const MAGIC: &[u8] = b"gs-chroma sections\n";

/// Bytes of the SHA-256.
const SUM: usize = 32;

/// Writes sections beside `path` and renames, once they are on the disk; gives the file's size.
///
/// # Errors
/// The system's.
pub(crate) fn write(path: &Path, sections: &[(&str, &[u8])]) -> io::Result<u64> {
    let mut file = atomic_file::create(path)?;
    let mut hasher = Sha256::new();
    let mut size = 0;
    let mut to = BufWriter::new(file.as_file_mut());
    let mut put = |bytes: &[u8]| {
        hasher.update(bytes);
        size += bytes.len() as u64;
        to.write_all(bytes)
    };
    put(MAGIC)?;
    for (name, bytes) in sections {
        put(&(name.len() as u64).to_le_bytes())?;
        put(name.as_bytes())?;
        put(&(bytes.len() as u64).to_le_bytes())?;
        put(bytes)?;
    }
    to.write_all(&hasher.finalize())?;
    to.flush()?;
    drop(to);
    file.as_file().sync_all()?;
    file.persist(path)?;
    Ok(size + SUM as u64)
}

/// Reads what [`write`] wrote; `None` of a file that is damaged or something else.
///
/// # Errors
/// The system's.
pub(crate) fn read(path: &Path) -> io::Result<Option<BTreeMap<String, Vec<u8>>>> {
    Ok(parse(&std::fs::read(path)?))
}

/// In hexadecimal.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    let sum = Sha256::digest(bytes);
    sum.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn parse(bytes: &[u8]) -> Option<BTreeMap<String, Vec<u8>>> {
    let (body, sum) = bytes.split_at_checked(bytes.len().checked_sub(SUM)?)?;
    if Sha256::digest(body)[..] != *sum {
        return None;
    }
    let mut rest = body.strip_prefix(MAGIC)?;
    let mut sections = BTreeMap::new();
    while !rest.is_empty() {
        let name = String::from_utf8(take(&mut rest)?.to_vec()).ok()?;
        sections.insert(name, take(&mut rest)?.to_vec());
    }
    Some(sections)
}

/// What is preceded by its length.
fn take<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, behind) = rest.split_at_checked(8)?;
    let length = u64::from_le_bytes(length.try_into().ok()?);
    let (taken, behind) = behind.split_at_checked(usize::try_from(length).ok()?)?;
    *rest = behind;
    Some(taken)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_come_back() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("kept");
        let size = write(&path, &[("one", b"1"), ("none", b""), ("two", &[7; 300])]).unwrap();
        assert_eq!(size, std::fs::metadata(&path).unwrap().len());
        let found = read(&path).unwrap().unwrap();
        assert_eq!(found.len(), 3);
        assert_eq!(found["two"], [7; 300]);
        assert!(found["none"].is_empty());
        assert!(read(&place.path().join("nowhere")).is_err());
    }

    #[test]
    fn a_damaged_file_is_none() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("kept");
        write(&path, &[("one", &[3; 40])]).unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in 0..whole.len() {
            assert!(parse(&whole[..length]).is_none());
        }
        for at in 0..whole.len() {
            let mut other = whole.clone();
            other[at] ^= 0x10;
            assert!(parse(&other).is_none(), "{at}");
        }
    }

    /// Lengths that lead out of the file, with a sum that is right.
    #[test]
    fn lengths_that_lie_are_noticed() {
        for length in [u64::MAX, 1 << 40, 2] {
            let mut bytes = MAGIC.to_vec();
            bytes.extend(length.to_le_bytes());
            bytes.push(b'x');
            let sum = Sha256::digest(&bytes);
            bytes.extend(sum);
            assert!(parse(&bytes).is_none());
        }
    }
}
