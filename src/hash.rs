//! SHA-256 in hexadecimal, of bytes and of files of any size.

use std::io::{self, Read};

use sha2::{Digest, Sha256};

/// Bytes that are read of a file at once.
const BLOCK: usize = 1 << 20;

/// SHA-256 of what it is told, one after the other.
#[derive(Default)]
pub(crate) struct Hasher(Sha256);

impl Hasher {
    /// Takes bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// Takes all that is left of a file.
    pub fn update_with(&mut self, mut file: impl Read) -> io::Result<()> {
        let mut block = vec![0; BLOCK];
        loop {
            match file.read(&mut block)? {
                0 => return Ok(()),
                count => self.0.update(&block[..count]),
            }
        }
    }

    /// In lower-case hexadecimal.
    pub fn finish(self) -> String {
        let digits = self.0.finalize();
        digits.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// SHA-256 of all that is left of a file.
pub(crate) fn of_file(file: impl Read) -> io::Result<String> {
    let mut hasher = Hasher::default();
    hasher.update_with(file)?;
    Ok(hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn abc_and_much_of_it() {
        // FIPS 180-2, appendices B.1 and B.3.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(of_file(&b"abc"[..]).unwrap(), expected);
        let expected = "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0";
        let million = io::repeat(b'a').take(1_000_000);
        assert_eq!(of_file(million).unwrap(), expected);
    }
}
