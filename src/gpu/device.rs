//! The graphics card: found, opened, and asked whether all went well.

use std::sync::{Arc, Mutex, PoisonError};
use wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::GpuError;

/// An open graphics card.
pub(super) struct Card {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    /// Its name, its driver, and whether it is one in software.
    pub(super) name: String,
    /// What its driver complained of first: the functions that ask it for something return nothing that says so.
    fault: Arc<Mutex<Option<String>>>,
}

impl Card {
    /// Opens the fastest card that the system offers; one in software where there is no other.
    pub(super) fn open() -> Result<Self, GpuError> {
        // old cards have no driver but OpenGL's; where there is another, it is not even woken
        let adapter = adapter(wgpu::Backends::PRIMARY).or_else(|_| adapter(wgpu::Backends::GL))?;
        let name = named(&adapter.get_info());
        let wanted = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..wgpu::DeviceDescriptor::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted))
            .map_err(|why| GpuError::Card { card: name.clone(), why: why.to_string() })?;
        let fault: Arc<Mutex<Option<String>>> = Arc::default();
        let told = Arc::clone(&fault);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            told.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| error.to_string());
        }));
        Ok(Self { device, queue, name, fault })
    }

    /// An error of this card.
    pub(super) fn error(&self, why: impl ToString) -> GpuError {
        GpuError::Card { card: self.name.clone(), why: why.to_string() }
    }

    /// What the driver has complained of since this was last asked.
    pub(super) fn check(&self) -> Result<(), GpuError> {
        let fault = self.fault.lock().unwrap_or_else(PoisonError::into_inner).take();
        fault.map_or(Ok(()), |why| Err(self.error(why)))
    }

    /// Waits until the card has done all that it was told to do.
    pub(super) fn wait(&self) -> Result<(), GpuError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|why| self.error(why))?;
        self.check()
    }

    /// A buffer with this in it; `what` is for a message.
    pub(super) fn buffer<T: bytemuck::NoUninit>(
        &self,
        what: &'static str,
        contents: &[T],
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer, GpuError> {
        let (bytes, limit) = (size_of_val(contents) as u64, self.device.limits().max_buffer_size);
        if bytes > limit {
            return Err(GpuError::TooLarge { card: self.name.clone(), what, bytes, limit });
        }
        let contents = bytemuck::cast_slice(contents);
        Ok(self.device.create_buffer_init(&BufferInitDescriptor { label: Some(what), contents, usage }))
    }
}

/// The fastest card that drivers of these kinds offer.
fn adapter(backends: wgpu::Backends) -> Result<wgpu::Adapter, GpuError> {
    let mut asked = wgpu::InstanceDescriptor::new_without_display_handle();
    asked.backends = backends;
    // drivers in software are not all certified, and draw well
    asked.flags = wgpu::InstanceFlags::ALLOW_UNDERLYING_NONCOMPLIANT_ADAPTER;
    let wanted = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    };
    pollster::block_on(wgpu::Instance::new(asked).request_adapter(&wanted))
        .map_err(|why| GpuError::NoAdapter { why: why.to_string() })
}

/// A card's name as people know it, with its driver.
fn named(info: &wgpu::AdapterInfo) -> String {
    let backend = format!("{:?}", info.backend);
    let software = if info.device_type == wgpu::DeviceType::Cpu { "in software" } else { "" };
    let driver = format!("{} {}", info.driver, info.driver_info);
    let known: Vec<&str> = [&backend, software, driver.trim()].into_iter().filter(|s| !s.is_empty()).collect();
    format!("{} ({})", info.name, known.join(", "))
}
