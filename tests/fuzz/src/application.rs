//! An application with an object of every kind, which watches what the node does with it.

use std::cell::Cell;

use eel_canopen::{Abort, Access, Application, Entry, Mapped};

/// The most bytes that the writable domain takes.
pub const WRITABLE_DOMAIN: usize = 4_096;
/// The most bytes that the text takes.
pub const TEXT: usize = 300;
/// The most that a frame or a tick may ask of an application: the mapping of four RPDOs and four TPDOs
/// with eight objects each, each described once more, and some.
const MOST_CALLS: u32 = 160;
/// The most bytes of domains that a frame or a tick may move: a block, and the next one's start.
const MOST_BYTES: usize = 2 * 889;

/// A domain being read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stream {
    subindex: u8,
    offset: usize,
}

/// Values, texts and domains.
#[derive(Clone, Debug)]
pub struct Objects {
    /// 0x2000: five values for RPDOs, as a target.
    pub target: [[u8; 2]; 5],
    /// 0x2002: eight bytes, one an object, for both directions.
    pub bytes: [u8; 8],
    /// 0x2010:3, for a TPDO alone.
    pub long: [u8; 8],
    /// 0x2020: a text that the bus may write.
    pub text: Vec<u8>,
    /// 0x2040: eight bytes.
    pub eight: [u8; 8],
    /// 0x2100:1: a domain to read.
    pub readable: Vec<u8>,
    /// 0x2100:2: a domain to write and to read; what was written is there when it is complete.
    pub writable: Vec<u8>,
    coming: Vec<u8>,
    reading: Option<Stream>,
    writing: Option<Stream>,
    /// Whether everything is refused.
    pub refuse: bool,
    calls: Cell<u32>,
    moved: Cell<usize>,
}

impl Objects {
    pub fn new() -> Self {
        Self {
            target: [[1, 2]; 5],
            bytes: [1, 2, 3, 4, 5, 6, 7, 8],
            long: *b"eel long",
            text: b"a text".to_vec(),
            eight: [9; 8],
            readable: (0..2_000_u32).map(|at| (7 * at + at / 256) as u8).collect(),
            writable: Vec::new(),
            coming: Vec::new(),
            reading: None,
            writing: None,
            refuse: false,
            calls: Cell::new(0),
            moved: Cell::new(0),
        }
    }

    /// Begins to count what the node asks for.
    pub fn start_counting(&mut self) {
        self.calls.set(0);
        self.moved.set(0);
    }

    /// Checks that the node asked for no more than a frame may cost.
    pub fn check_work(&self) {
        let (calls, moved) = (self.calls.get(), self.moved.get());
        assert!(calls <= MOST_CALLS, "{calls} calls for one frame");
        assert!(
            moved <= MOST_BYTES,
            "{moved} bytes of a domain for one frame"
        );
    }

    /// Tells whether a domain is half written.
    pub fn is_writing(&self) -> bool {
        self.writing.is_some()
    }

    fn count(&self) -> Result<(), Abort> {
        self.calls.set(self.calls.get() + 1);
        if self.refuse {
            Err(Abort::DeviceState)
        } else {
            Ok(())
        }
    }

    fn place(&mut self, index: u16, subindex: u8) -> Result<&mut [u8], Abort> {
        let at = usize::from(subindex).wrapping_sub(1);
        match index {
            0x2000 if at < 3 => Ok(&mut self.target[at]),
            0x2000 if at < 5 => Ok(&mut self.target[at][..1]),
            0x2002 if at < 8 => Ok(&mut self.bytes[at..=at]),
            0x2040 if subindex == 0 => Ok(&mut self.eight),
            _ => Err(Abort::NoSubindex),
        }
    }
}

impl Application for Objects {
    fn entry(&self, index: u16, subindex: u8) -> Result<Entry, Abort> {
        // Counted, but never refused: a dictionary stays.
        let _ = self.count();
        let (length, access, tpdo, rpdo) = match (index, subindex) {
            (0x2000 | 0x2002 | 0x2010 | 0x2100, 0) => (1, Access::Constant, false, false),
            (0x2000, 1..=3) => (2, Access::ReadWrite, false, true),
            (0x2000, 4..=5) => (1, Access::ReadWrite, false, true),
            (0x2002, 1..=8) => (1, Access::ReadWrite, true, true),
            (0x2010, 1) => (2, Access::ReadOnly, true, false),
            (0x2010, 2) => (4, Access::ReadOnly, true, false),
            (0x2010, 3) => (8, Access::ReadOnly, true, false),
            (0x2020, 0) => (0, Access::ReadWrite, false, false),
            (0x2021, 0) => (4, Access::WriteOnly, false, false),
            (0x2030, 0) => (0, Access::Constant, false, false),
            (0x2040, 0) => (8, Access::ReadWrite, true, true),
            (0x2100, 1) => (0, Access::ReadOnly, false, false),
            (0x2100, 2) => (0, Access::ReadWrite, false, false),
            (0x2000 | 0x2002 | 0x2010 | 0x2020 | 0x2021 | 0x2030 | 0x2040 | 0x2100, _) => {
                return Err(Abort::NoSubindex);
            }
            _ => return Err(Abort::NoObject),
        };
        Ok(Entry {
            length,
            domain: index == 0x2100 && subindex > 0,
            access,
            tpdo,
            rpdo,
        })
    }

    fn read(&self, index: u16, subindex: u8, out: &mut [u8]) -> Result<usize, Abort> {
        self.count()?;
        let at = usize::from(subindex).wrapping_sub(1);
        let value: &[u8] = match (index, subindex) {
            (0x2000, 1..=3) => &self.target[at],
            (0x2000, 4..=5) => &self.target[at][..1],
            (0x2002, 1..=8) => &self.bytes[at..=at],
            (0x2000 | 0x2002 | 0x2010 | 0x2100, 0) => &[8],
            (0x2010, 1) => &[0x22, 0x11],
            (0x2010, 2) => &[0x66, 0x55, 0x44, 0x33],
            (0x2010, 3) => &self.long,
            (0x2020, 0) => &self.text,
            (0x2030, 0) => b"a constant text that takes some segments",
            (0x2040, 0) => &self.eight,
            _ => return Err(Abort::NoObject),
        };
        out.get_mut(..value.len())
            .ok_or(Abort::OutOfMemory)?
            .copy_from_slice(value);
        Ok(value.len())
    }

    fn write(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), Abort> {
        self.count()?;
        match (index, subindex) {
            (0x2020, 0) if data.len() <= TEXT => self.text = data.to_vec(),
            (0x2020, 0) => return Err(Abort::OutOfMemory),
            (0x2021, 0) => {}
            _ => {
                let place = self.place(index, subindex)?;
                if place.len() != data.len() {
                    return Err(Abort::Length);
                }
                place.copy_from_slice(data);
            }
        }
        Ok(())
    }

    fn rpdo_applied(&mut self, number: u8, _cob_id: u16) {
        assert!(matches!(number, 1..=4));
        let _ = self.count();
    }

    fn tpdo_due(&mut self, number: u8, _: u16, mapping: &[Mapped]) -> Option<[u8; 8]> {
        assert!(matches!(number, 1..=4) && mapping.len() <= 8);
        let _ = self.count();
        None
    }

    fn synchronised(&mut self, _counter: Option<u8>) {
        let _ = self.count();
    }

    fn open_domain(&mut self, index: u16, subindex: u8) -> Result<u32, Abort> {
        self.count()?;
        let length = match (index, subindex) {
            (0x2100, 1) => self.readable.len(),
            (0x2100, 2) => self.writable.len(),
            _ => return Err(Abort::NoObject),
        };
        self.reading = Some(Stream {
            subindex,
            offset: 0,
        });
        Ok(length as u32)
    }

    fn read_domain(
        &mut self,
        index: u16,
        subindex: u8,
        offset: u32,
        out: &mut [u8],
    ) -> Result<usize, Abort> {
        self.count()?;
        let stream = self.reading.as_mut().expect("opened before it is read");
        let at = offset as usize;
        assert_eq!(
            (index, stream.subindex, stream.offset),
            (0x2100, subindex, at),
            "read in order and without gaps"
        );
        let domain = if subindex == 1 {
            &self.readable
        } else {
            &self.writable
        };
        // What was written meanwhile may be shorter than what was opened.
        let rest = domain.get(at..).ok_or(Abort::NoData)?;
        let length = rest.len().min(out.len());
        out[..length].copy_from_slice(&rest[..length]);
        stream.offset += length;
        self.moved.set(self.moved.get() + length);
        Ok(length)
    }

    fn begin_domain(&mut self, index: u16, subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        self.count()?;
        assert_eq!((index, subindex), (0x2100, 2), "only what may be written");
        assert_eq!(self.writing, None, "the one before was ended");
        if length.is_some_and(|length| length as usize > WRITABLE_DOMAIN) {
            return Err(Abort::OutOfMemory);
        }
        self.coming.clear();
        self.writing = Some(Stream {
            subindex,
            offset: 0,
        });
        Ok(())
    }

    fn write_domain(
        &mut self,
        index: u16,
        subindex: u8,
        offset: u32,
        data: &[u8],
    ) -> Result<(), Abort> {
        self.count()?;
        let stream = self.writing.as_mut().expect("begun before it is written");
        assert_eq!(
            (index, stream.subindex, stream.offset),
            (0x2100, subindex, offset as usize),
            "written in order and without gaps"
        );
        stream.offset += data.len();
        self.moved.set(self.moved.get() + data.len());
        if stream.offset > WRITABLE_DOMAIN {
            return Err(Abort::OutOfMemory);
        }
        self.coming.extend_from_slice(data);
        Ok(())
    }

    fn end_domain(&mut self, index: u16, subindex: u8, length: Option<u32>) -> Result<(), Abort> {
        self.calls.set(self.calls.get() + 1);
        let stream = self.writing.take().expect("begun before it is ended");
        assert_eq!((index, subindex), (0x2100, stream.subindex));
        if let Some(length) = length {
            assert_eq!(length as usize, self.coming.len(), "all of it came");
            self.writable = std::mem::take(&mut self.coming);
        }
        Ok(())
    }

    fn may_configure(&self) -> Result<(), Abort> {
        self.count()
    }
}
