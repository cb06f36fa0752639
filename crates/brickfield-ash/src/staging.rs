//! Between host and device: buffers in the host's reach, through which everything is copied.

use std::sync::Arc;

use brickfield_frame::RenderError;

use crate::vulkan::{Buffer, Device, HostBuffer, Queue, Residence, Use};

/// Host buffers for both directions, as large as they had to be, at most a chunk or one row of pixels.
pub(crate) struct Staging {
    device: Arc<Device>,
    chunk_bytes: usize,
    upload: Option<HostBuffer>,
    read_back: Option<HostBuffer>,
}

/// New content for a part of a buffer on the device.
#[derive(Clone, Copy)]
pub(crate) struct Write<'a> {
    pub(crate) target: &'a Buffer,
    pub(crate) offset: u64,
    pub(crate) bytes: &'a [u8],
}

/// A part of a buffer's new content, and where it lies on the way.
struct StagedWrite<'a> {
    target: &'a Buffer,
    target_offset: u64,
    staging_offset: usize,
    bytes: &'a [u8],
}

impl Staging {
    /// No buffers yet; at most `chunk_bytes` are to be copied at once.
    pub(crate) fn new(device: &Arc<Device>, chunk_bytes: usize) -> Staging {
        Staging { device: device.clone(), chunk_bytes: chunk_bytes.max(1), upload: None, read_back: None }
    }

    /// How many pieces of so many bytes are copied at once: at least one.
    pub(crate) fn pieces_at_once(&self, piece_bytes: usize) -> usize {
        (self.chunk_bytes / piece_bytes).max(1)
    }

    /// A buffer of at least `n_bytes` that the host fills.
    pub(crate) fn upload(&mut self, n_bytes: usize) -> Result<&mut HostBuffer, RenderError> {
        reserve(&mut self.upload, &self.device, n_bytes, Residence::Upload)
    }

    /// A buffer of at least `n_bytes` that the device fills.
    pub(crate) fn read_back(&mut self, n_bytes: usize) -> Result<&mut HostBuffer, RenderError> {
        reserve(&mut self.read_back, &self.device, n_bytes, Residence::ReadBack)
    }

    /// Frees a large upload buffer; small ones are kept for the next frame.
    pub(crate) fn shrink(&mut self) {
        self.upload.take_if(|b| b.buffer().n_bytes() > (self.chunk_bytes / 16) as u64);
    }

    /// Fills parts of buffers on the device, for shaders to read.
    pub(crate) fn fill(&mut self, queue: &mut Queue, writes: &[Write<'_>]) -> Result<(), RenderError> {
        for batch in batches(writes, self.chunk_bytes) {
            let staging = self.upload(batch.iter().map(|p| p.bytes.len()).sum())?;
            for piece in &batch {
                staging.write(piece.staging_offset, piece.bytes);
            }
            let from = staging.buffer();
            queue.run("uploading a frame's data", |recorder| {
                for run in batch.chunk_by(StagedWrite::is_followed_by) {
                    let n_bytes: usize = run.iter().map(|piece| piece.bytes.len()).sum();
                    let (from, to) = ((from, run[0].staging_offset as u64), (run[0].target, run[0].target_offset));
                    recorder.copy(from, to, n_bytes as u64);
                }
                recorder.barrier(Use::CopyTarget, Use::ShaderRead);
            })?;
        }
        Ok(())
    }

    /// The first `n_bytes` of a buffer on the device that a shader wrote.
    pub(crate) fn read(&mut self, queue: &mut Queue, from: &Buffer, n_bytes: usize) -> Result<&[u8], RenderError> {
        let to = self.read_back(n_bytes)?;
        let target = to.buffer();
        queue.run("reading results back", |recorder| {
            recorder.barrier(Use::ShaderWrite, Use::CopySource);
            recorder.copy((from, 0), (target, 0), n_bytes as u64);
            recorder.barrier(Use::CopyTarget, Use::HostRead);
        })?;
        Ok(to.read(n_bytes))
    }
}

fn reserve<'a>(
    slot: &'a mut Option<HostBuffer>,
    device: &Arc<Device>,
    n_bytes: usize,
    residence: Residence,
) -> Result<&'a mut HostBuffer, RenderError> {
    slot.take_if(|b| b.buffer().n_bytes() < n_bytes as u64);
    match slot {
        Some(buffer) => Ok(buffer),
        None => Ok(slot.insert(HostBuffer::new(device, (n_bytes as u64).next_power_of_two().max(1 << 16), residence)?)),
    }
}

impl StagedWrite<'_> {
    /// Whether another piece lies right behind this one, on both sides: one copy is enough for both.
    fn is_followed_by(&self, other: &StagedWrite<'_>) -> bool {
        let n_bytes = self.bytes.len();
        std::ptr::eq(self.target, other.target)
            && self.target_offset + n_bytes as u64 == other.target_offset
            && self.staging_offset + n_bytes == other.staging_offset
    }
}

/// Cuts contents into batches of at most `capacity` bytes.
fn batches<'a>(writes: &[Write<'a>], capacity: usize) -> Vec<Vec<StagedWrite<'a>>> {
    let mut batches: Vec<Vec<StagedWrite<'a>>> = Vec::new();
    let mut used = capacity;
    for &Write { target, offset, bytes } in writes {
        for (i, bytes) in bytes.chunks(capacity).enumerate() {
            if used + bytes.len() > capacity {
                batches.push(Vec::new());
                used = 0;
            }
            let target_offset = offset + (i * capacity) as u64;
            let piece = StagedWrite { target, target_offset, staging_offset: used, bytes };
            used += bytes.len();
            match batches.last_mut() {
                Some(batch) => batch.push(piece),
                None => batches.push(vec![piece]),
            }
        }
    }
    batches
}
