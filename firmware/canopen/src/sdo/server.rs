//! Which transfer runs, and what each request does to it.

use super::block::{Block, Heard};
use super::download::Download;
use super::upload::{Upload, check_block_size};
use super::{BLOCK, Buffer, Message, Multiplexor, SDO_BUFFER, message};
use crate::deadline::after;
use crate::objects::Objects;
use crate::{Abort, Application};

/// Silence of the client after which a transfer is aborted.
const TIMEOUT_US: u32 = 1_000_000;
/// The command of an abort, in both directions.
const ABORT: u8 = 0x80;

#[derive(Clone, Debug)]
enum Transfer {
    Idle,
    Upload(Upload),
    Download(Download),
}

/// The server side of one SDO channel.
#[derive(Clone, Debug)]
pub(crate) struct Server {
    transfer: Transfer,
    /// What is transferred; what an abort names.
    object: Multiplexor,
    /// The domain that was begun and has not been ended.
    begun: Option<Multiplexor>,
    /// When the client has been silent for too long.
    deadline_us: u64,
    /// What is to be said in return.
    answer: Option<Message>,
    buffer: Buffer,
}

impl Server {
    pub const fn new() -> Self {
        Self {
            transfer: Transfer::Idle,
            object: Multiplexor::NONE,
            begun: None,
            deadline_us: 0,
            answer: None,
            buffer: [0; SDO_BUFFER],
        }
    }

    /// Forgets a running transfer without a word; [`settle`](Self::settle) must follow.
    #[inline(never)] // One copy in flash.
    pub fn reset(&mut self) {
        self.transfer = Transfer::Idle;
        self.object = Multiplexor::NONE;
    }

    /// Tells whether nothing is transferred.
    #[inline]
    pub const fn is_idle(&self) -> bool {
        matches!(self.transfer, Transfer::Idle)
    }

    /// Tells whether the application has begun to write a domain, so that [`settle`](Self::settle) may
    /// have something to tell it.
    #[inline]
    pub const fn has_begun(&self) -> bool {
        self.begun.is_some()
    }

    /// Tells the application of a domain whose download was broken off. To be called after everything
    /// that may break one off.
    pub fn settle(&mut self, app: &mut dyn Application) {
        if !matches!(self.transfer, Transfer::Download(_))
            && let Some(Multiplexor { index, subindex }) = self.begun.take()
        {
            // There is nobody left to tell that it failed.
            let _ = app.end_domain(index, subindex, None);
        }
    }

    /// Ends a transfer whose client fell silent, or tells the client what is missing: the message
    /// to send about it.
    pub fn expire(&mut self, now_us: u64) -> Option<Message> {
        let good = match &mut self.transfer {
            Transfer::Idle => return None,
            _ if now_us >= self.deadline_us => Err(Abort::Timeout),
            Transfer::Upload(_) => return None,
            Transfer::Download(download) => download.block.as_mut()?.expire(now_us),
        };
        match good {
            Ok(good) => good.map(acknowledgement),
            Err(abort) => Some(self.abort(abort)),
        }
    }

    /// Answers a request; `None` when it needs no answer.
    pub fn request(&mut self, request: Message, objects: &mut Objects<'_>) -> Option<Message> {
        self.answer = None;
        match self.serve(request, objects) {
            Ok(()) => self.answer,
            Err(abort) => Some(self.abort(abort)),
        }
    }

    /// Tells whether segments of an upload may be on their way.
    pub fn is_streaming(&self) -> bool {
        matches!(&self.transfer, Transfer::Upload(upload) if upload.is_streaming())
    }

    /// Makes the next segment of a block upload: at most one for each that the client asked for.
    pub fn segment(&mut self, objects: &mut Objects<'_>) -> Option<Message> {
        let Transfer::Upload(upload) = &mut self.transfer else {
            return None;
        };
        if !upload.has_segment() {
            return None;
        }
        self.deadline_us = after(objects.now_us, TIMEOUT_US);
        let segment = upload.next(&mut self.buffer, objects);
        Some(segment.unwrap_or_else(|abort| self.abort(abort)))
    }

    #[inline(never)] // One copy in flash.
    fn serve(&mut self, request: Message, objects: &mut Objects<'_>) -> Result<(), Abort> {
        let [command, first, second, ..] = request;
        if let Transfer::Download(download) = &self.transfer
            && download.is_in_block()
            && command != ABORT
        {
            return self.block_segment(request, objects);
        }
        self.deadline_us = after(objects.now_us, TIMEOUT_US);
        match (command >> 5, command & 3) {
            (0, _) => self.download_segment(request, objects),
            (1, _) => self.start_download(request, objects),
            (2, _) => self.start_upload(request, objects),
            (3, _) => self.upload_segment(command, objects),
            (4, _) => {
                self.reset();
                Ok(())
            }
            (5, 0) => self.start_block_upload(request, objects),
            (5, 1) => {
                self.upload()?.0.end()?;
                self.reset();
                Ok(())
            }
            (5, 2) => {
                self.answer = self.upload()?.0.acknowledge(first, second)?;
                Ok(())
            }
            (5, 3) => self.upload()?.0.start(),
            (6, 0 | 2) => self.start_block_download(request, objects),
            (6, _) => self.end_block_download(request, objects),
            _ => Err(Abort::Command),
        }
    }

    /// Answers with the four bytes of `data` and the object.
    #[inline(never)] // One copy in flash.
    fn say(&mut self, command: u8, data: [u8; 4]) {
        self.answer = Some(message(command, self.object, data));
    }

    /// Ends the transfer and makes the message that says why.
    #[inline(never)] // One copy in flash.
    fn abort(&mut self, abort: Abort) -> Message {
        let object = self.object;
        self.reset();
        message(ABORT, object, abort.code().to_le_bytes())
    }

    fn upload(&mut self) -> Result<(&mut Upload, &mut Buffer), Abort> {
        match &mut self.transfer {
            Transfer::Upload(upload) => Ok((upload, &mut self.buffer)),
            _ => Err(Abort::Command),
        }
    }

    fn download(&mut self) -> Result<(&mut Download, &mut Buffer), Abort> {
        match &mut self.transfer {
            Transfer::Download(download) => Ok((download, &mut self.buffer)),
            _ => Err(Abort::Command),
        }
    }

    /// Ends what runs and names the object of the request, from now on. Returns the other four bytes.
    #[inline(never)] // One copy in flash.
    fn start(&mut self, request: Message, objects: &mut Objects<'_>) -> [u8; 4] {
        let [_, low, high, subindex, data @ ..] = request;
        self.reset();
        self.settle(objects.app);
        self.object = Multiplexor {
            index: u16::from_le_bytes([low, high]),
            subindex,
        };
        data
    }

    fn start_upload(&mut self, request: Message, objects: &mut Objects<'_>) -> Result<(), Abort> {
        self.start(request, objects);
        let length = self.open_upload(objects)?;
        self.answer_upload(length, objects)
    }

    /// Opens the object to be sent, and returns its length.
    #[inline(never)] // One copy in flash.
    fn open_upload(&mut self, objects: &mut Objects<'_>) -> Result<u32, Abort> {
        let upload = Upload::open(self.object, &mut self.buffer, objects)?;
        let length = upload.length();
        self.transfer = Transfer::Upload(upload);
        Ok(length)
    }

    /// Answers with the object itself where it fits, otherwise with its length.
    #[inline(never)] // One copy in flash.
    fn answer_upload(&mut self, length: u32, objects: &mut Objects<'_>) -> Result<(), Abort> {
        if !matches!(length, 1..=4) {
            self.say(0x41, length.to_le_bytes());
            return Ok(());
        }
        let (upload, buffer) = self.upload()?;
        let data = upload.first(buffer, objects)?;
        let unused = 4 - length as u8;
        self.say(0x43 | unused << 2, data);
        self.reset();
        Ok(())
    }

    fn upload_segment(&mut self, command: u8, objects: &mut Objects<'_>) -> Result<(), Abort> {
        let (upload, buffer) = self.upload()?;
        let segment = upload.segment(command, buffer, objects)?;
        let [flags, ..] = segment;
        if flags & 1 != 0 {
            self.reset();
        }
        self.answer = Some(segment);
        Ok(())
    }

    fn start_block_upload(
        &mut self,
        request: Message,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let [command, ..] = request;
        let [size, threshold, ..] = self.start(request, objects);
        check_block_size(size)?;
        let length = self.open_upload(objects)?;
        if threshold > 0 && length <= u32::from(threshold) {
            return self.answer_upload(length, objects);
        }
        let (upload, _) = self.upload()?;
        upload.use_blocks(size, command & 4 != 0);
        // A CRC is offered to those who ask for one: others would check one that is not there.
        self.say(0xC2 | command & 4, length.to_le_bytes());
        Ok(())
    }

    fn start_download(&mut self, request: Message, objects: &mut Objects<'_>) -> Result<(), Abort> {
        let [command, ..] = request;
        let data = self.start(request, objects);
        let expedited = command & 2 != 0;
        let size = if expedited {
            4 - u32::from(command >> 2 & 3)
        } else {
            u32::from_le_bytes(data)
        };
        self.open_download((command & 1 != 0).then_some(size), None, objects)?;
        self.say(0x60, [0; 4]);
        if expedited {
            let (download, buffer) = self.download()?;
            download.expedited(data, buffer, objects)?;
            self.finish_download(objects)?;
        }
        Ok(())
    }

    fn start_block_download(
        &mut self,
        request: Message,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let [command, ..] = request;
        let data = self.start(request, objects);
        let size = (command & 2 != 0).then_some(u32::from_le_bytes(data));
        self.open_download(size, Some(command & 4 != 0), objects)?;
        self.say(0xA4, [BLOCK, 0, 0, 0]);
        Ok(())
    }

    /// Opens the object to be received; `blocks` tells whether it comes in blocks, and with a CRC.
    #[inline(never)] // One copy in flash.
    fn open_download(
        &mut self,
        size: Option<u32>,
        blocks: Option<bool>,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let mut download = Download::open(self.object, size, objects)?;
        self.begun = download.domain.then_some(self.object);
        download.block = blocks.map(Block::new);
        self.transfer = Transfer::Download(download);
        Ok(())
    }

    fn download_segment(
        &mut self,
        request: Message,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let [command, ..] = request;
        let (download, buffer) = self.download()?;
        if download.segment(request, buffer, objects)? {
            self.finish_download(objects)?;
        }
        self.answer = Some([0x20 | command & 0x10, 0, 0, 0, 0, 0, 0, 0]);
        Ok(())
    }

    fn block_segment(&mut self, request: Message, objects: &mut Objects<'_>) -> Result<(), Abort> {
        let [first, ..] = request;
        let (download, buffer) = self.download()?;
        download.block_segment(request, buffer, objects);
        let block = download.block.as_mut().ok_or(Abort::General)?;
        match block.hear(first, objects.now_us)? {
            Heard::Again => return Ok(()),
            Heard::Forward => {}
            Heard::Acknowledge(good) => self.answer = Some(acknowledgement(good)),
        }
        self.deadline_us = after(objects.now_us, TIMEOUT_US);
        Ok(())
    }

    fn end_block_download(
        &mut self,
        request: Message,
        objects: &mut Objects<'_>,
    ) -> Result<(), Abort> {
        let (download, buffer) = self.download()?;
        download.end_blocks(request, buffer, objects)?;
        self.finish_download(objects)?;
        self.answer = Some([0xA1, 0, 0, 0, 0, 0, 0, 0]);
        Ok(())
    }

    #[inline(never)] // One copy in flash.
    fn finish_download(&mut self, objects: &mut Objects<'_>) -> Result<(), Abort> {
        let Transfer::Download(download) = &self.transfer else {
            return Err(Abort::General);
        };
        download.check_complete()?;
        // Well or not, the domain has been ended from here on.
        self.begun = None;
        download.finish(&self.buffer, objects)?;
        self.reset();
        Ok(())
    }
}

fn acknowledgement(good: u8) -> Message {
    [0xA2, good, BLOCK, 0, 0, 0, 0, 0]
}
