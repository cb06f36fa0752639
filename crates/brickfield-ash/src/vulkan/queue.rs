//! The queue: records commands, hands them over, and waits for their end.
#![expect(unsafe_code, reason = "Vulkan's functions are foreign")]

use std::sync::Arc;

use ash::vk;
use brickfield_frame::RenderError;

use super::{Device, Recorder};
use crate::error::{FailedCall, OfCall};

/// The device's queue, with a command buffer that is used again and again.
pub(crate) struct Queue {
    raw: vk::Queue,
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    fence: vk::Fence,
    timestamps: Option<Timestamps>,
    device: Arc<Device>,
}

/// Two timestamps, and their unit.
#[derive(Clone, Copy)]
struct Timestamps {
    pool: vk::QueryPool,
    mask: u64,
    ms_per_tick: f64,
}

impl Queue {
    /// The queue of a device.
    pub(crate) fn new(device: &Arc<Device>) -> Result<Queue, FailedCall> {
        // SAFETY: the device was made with one queue of this family.
        let raw = unsafe { device.raw().get_device_queue(device.family.index, 0) };
        let mut queue = Queue {
            raw,
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            timestamps: None,
            device: device.clone(),
        };
        queue.create_commands()?;
        queue.create_timestamps()?;
        Ok(queue)
    }

    /// Records, submits, and waits until the device has finished.
    ///
    /// Recorded objects are borrowed for `'a`, which lasts at least until the device has finished. If `record` panics nothing
    /// is submitted, and the queue can be used again.
    pub(crate) fn run<'a>(
        &mut self,
        doing: &'static str,
        record: impl FnOnce(&mut Recorder<'_, 'a>),
    ) -> Result<(), RenderError> {
        self.try_run(None, record).map_err(|failed| failed.while_doing(doing))
    }

    /// As [`run`](Self::run); returns the milliseconds on the device, if it measures time.
    pub(crate) fn run_timed<'a>(
        &mut self,
        doing: &'static str,
        record: impl FnOnce(&mut Recorder<'_, 'a>),
    ) -> Result<Option<f64>, RenderError> {
        let timestamps = self.timestamps;
        self.try_run(timestamps, record)
            .and_then(|()| timestamps.map(|t| self.elapsed_ms(t)).transpose())
            .map_err(|failed| failed.while_doing(doing))
    }

    fn try_run<'a>(
        &mut self,
        timestamps: Option<Timestamps>,
        record: impl FnOnce(&mut Recorder<'_, 'a>),
    ) -> Result<(), FailedCall> {
        let (device, commands) = (self.device.raw(), self.commands);
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // A panic while commands are recorded leaves the command buffer open, where beginning is invalid: it is reset first.
        // SAFETY: the last run has ended, so the command buffer is not pending; in every other state it may be reset, and
        // its pool allows that.
        unsafe { device.reset_command_buffer(commands, vk::CommandBufferResetFlags::empty()) }
            .of("vkResetCommandBuffer")?;
        // SAFETY: the command buffer was reset.
        unsafe { device.begin_command_buffer(commands, &begin) }.of("vkBeginCommandBuffer")?;
        if let Some(t) = timestamps {
            // SAFETY: the pool has two queries, which are reset before they are written.
            unsafe {
                device.cmd_reset_query_pool(commands, t.pool, 0, 2);
                device.cmd_write_timestamp(commands, vk::PipelineStageFlags::TOP_OF_PIPE, t.pool, 0);
            }
        }
        record(&mut Recorder::new(device, commands));
        if let Some(t) = timestamps {
            // SAFETY: as above.
            unsafe { device.cmd_write_timestamp(commands, vk::PipelineStageFlags::BOTTOM_OF_PIPE, t.pool, 1) };
        }
        // SAFETY: the command buffer is being recorded.
        unsafe { device.end_command_buffer(commands) }.of("vkEndCommandBuffer")?;
        self.submit_and_wait()
    }

    fn submit_and_wait(&mut self) -> Result<(), FailedCall> {
        let device = self.device.raw();
        let (commands, fences) = ([self.commands], [self.fence]);
        // SAFETY: the command buffer is recorded, its objects are borrowed by the caller, the fence is not in use.
        let ended = unsafe {
            device
                .reset_fences(&fences)
                .of("vkResetFences")
                .and_then(|()| {
                    let submit = vk::SubmitInfo::default().command_buffers(&commands);
                    device.queue_submit(self.raw, &[submit], self.fence).of("vkQueueSubmit")
                })
                .and_then(|()| device.wait_for_fences(&fences, true, u64::MAX).of("vkWaitForFences"))
        };
        if ended.is_err() {
            // SAFETY: no other thread has the queue. If this fails too the device is lost, and with it all pending work.
            let _ = unsafe { device.device_wait_idle() };
        }
        ended
    }

    fn elapsed_ms(&self, t: Timestamps) -> Result<f64, FailedCall> {
        let mut ticks = [0u64; 2];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: both queries were written by commands that have ended.
        unsafe { self.device.raw().get_query_pool_results(t.pool, 0, &mut ticks, flags) }
            .of("vkGetQueryPoolResults")?;
        Ok((ticks[1].wrapping_sub(ticks[0]) & t.mask) as f64 * t.ms_per_tick)
    }

    fn create_commands(&mut self) -> Result<(), FailedCall> {
        let device = self.device.raw();
        let pool = vk::CommandPoolCreateInfo::default()
            .queue_family_index(self.device.family.index)
            .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
        // SAFETY: the family is the device's.
        self.pool = unsafe { device.create_command_pool(&pool, None) }.of("vkCreateCommandPool")?;
        let commands = vk::CommandBufferAllocateInfo::default().command_pool(self.pool).command_buffer_count(1);
        // SAFETY: the pool is new.
        self.commands = unsafe { device.allocate_command_buffers(&commands) }.of("vkAllocateCommandBuffers")?[0];
        // SAFETY: a plain description.
        self.fence = unsafe { device.create_fence(&vk::FenceCreateInfo::default(), None) }.of("vkCreateFence")?;
        Ok(())
    }

    fn create_timestamps(&mut self) -> Result<(), FailedCall> {
        let bits = self.device.family.timestamp_bits;
        let ms_per_tick = f64::from(self.device.physical().limits.timestamp_period) * 1e-6;
        if bits == 0 || ms_per_tick == 0.0 {
            return Ok(());
        }
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(2);
        // SAFETY: the family has timestamps.
        let pool = unsafe { self.device.raw().create_query_pool(&info, None) }.of("vkCreateQueryPool")?;
        self.timestamps = Some(Timestamps { pool, mask: u64::MAX >> 64u32.saturating_sub(bits), ms_per_tick });
        Ok(())
    }
}

impl Drop for Queue {
    fn drop(&mut self) {
        let device = self.device.raw();
        // SAFETY: every run has ended, so nothing is in use; null handles are allowed. Commands go with their pool.
        unsafe {
            if let Some(t) = self.timestamps {
                device.destroy_query_pool(t.pool, None);
            }
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}
