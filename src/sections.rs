//! A file of named sections of bytes, with a SHA-256 at its end: whole, or known not to be.

use std::{
    collections::BTreeMap,
    io::{self, Write},
};

use sha2::{Digest, Sha256};

/// Magic bytes of the file.
const MAGIC: &[u8] = b"gs-chroma sections\n";

/// Bytes of the SHA-256.
const SUM: usize = 32;

/// Writes sections; gives how many bytes these take.
pub(crate) fn write(to: &mut dyn Write, sections: &[(&str, &[u8])]) -> io::Result<u64> {
    let mut hasher = Sha256::new();
    let mut size = 0;
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
    Ok(size + SUM as u64)
}

/// Sections that [`write`] wrote; `None` if the bytes are damaged or something else.
pub(crate) fn read(bytes: &[u8]) -> Option<BTreeMap<String, Vec<u8>>> {
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

/// Bytes preceded by their length.
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

    fn written(sections: &[(&str, &[u8])]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let size = write(&mut bytes, sections).unwrap();
        assert_eq!(size, bytes.len() as u64);
        bytes
    }

    #[test]
    fn sections_come_back() {
        let found = read(&written(&[
            ("one", b"1"),
            ("none", b""),
            ("two", &[7; 300]),
        ]));
        let found = found.unwrap();
        assert_eq!(found.len(), 3);
        assert_eq!(found["two"], [7; 300]);
        assert!(found["none"].is_empty());
    }

    #[test]
    fn damaged_bytes_are_none() {
        let whole = written(&[("one", &[3; 40])]);
        for length in 0..whole.len() {
            assert!(read(&whole[..length]).is_none());
        }
        for at in 0..whole.len() {
            let mut other = whole.clone();
            other[at] ^= 0x10;
            assert!(read(&other).is_none(), "{at}");
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
            assert!(read(&bytes).is_none());
        }
    }
}
