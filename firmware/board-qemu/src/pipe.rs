//! Files and pipes of the host, over semihosting.

use cortex_m_semihosting::{nr, syscall};

/// A file or pipe of the host, for reading or for writing.
pub struct Pipe {
    handle: usize,
}

/// The host did not take or give what was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Broken;

impl Pipe {
    /// Opens for reading. The path ends with a NUL.
    pub fn open(path: &'static core::ffi::CStr) -> Result<Self, Broken> {
        Self::with_mode(path, nr::open::R_BINARY)
    }

    /// Opens for writing. The path ends with a NUL.
    pub fn create(path: &'static core::ffi::CStr) -> Result<Self, Broken> {
        Self::with_mode(path, nr::open::RW_TRUNC_BINARY)
    }

    fn with_mode(path: &'static core::ffi::CStr, mode: usize) -> Result<Self, Broken> {
        let block = [path.as_ptr() as usize, mode, path.count_bytes()];
        // SAFETY: SYS_OPEN reads the block and the path, which live until it returns.
        let handle = unsafe { syscall(nr::OPEN, &block) };
        if handle == usize::MAX {
            Err(Broken)
        } else {
            Ok(Self { handle })
        }
    }

    /// Fills the buffer, waiting for what has not come yet. Returns whether the other side was
    /// still there; an end in the middle of the buffer is broken.
    pub fn fill(&mut self, buffer: &mut [u8]) -> Result<bool, Broken> {
        let mut filled = 0;
        while let Some(rest) = buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
            let block = [self.handle, rest.as_mut_ptr() as usize, rest.len()];
            // SAFETY: SYS_READ writes at most `rest.len()` bytes to `rest`, which lives.
            let missing = unsafe { syscall(nr::READ, &block) };
            match rest.len().checked_sub(missing) {
                Some(0) if filled == 0 => return Ok(false),
                Some(0) | None => return Err(Broken),
                Some(read) => filled += read,
            }
        }
        Ok(true)
    }

    /// Writes all bytes.
    pub fn write_all(&mut self, bytes: &[u8]) -> Result<(), Broken> {
        let block = [self.handle, bytes.as_ptr() as usize, bytes.len()];
        // SAFETY: SYS_WRITE reads `bytes.len()` bytes from `bytes`, which lives.
        let missing = unsafe { syscall(nr::WRITE, &block) };
        if missing == 0 { Ok(()) } else { Err(Broken) }
    }
}
