//! One tile of a picture: drawn, averaged, read back.

use glam::Vec3;
use std::time::Instant;

use super::GpuError;
use super::device::Card;
use super::frame::{SunView, Tile, View};
use super::pipelines::{DEPTH, LIGHT, Pipelines, shadow_pipeline};
use super::upload::{Model, bind_group, described};
use crate::panorama::Picture;

/// What a tile of a size is drawn into.
pub(super) struct Targets {
    /// Width and height in pixels, and samples along a pixel's side.
    size: [u32; 3],
    light: wgpu::TextureView,
    depth: wgpu::TextureView,
    /// The light, as the mean is taken of it.
    samples: wgpu::BindGroup,
    means: wgpu::Texture,
    means_view: wgpu::TextureView,
    /// Rows padded as cards want them.
    read: wgpu::Buffer,
    row_bytes: u32,
}

impl Targets {
    /// For tiles of so many pixels with `side` × `side` samples each.
    fn new(card: &Card, pipelines: &Pipelines, width: u32, height: u32, side: u32) -> Self {
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let make = |label, scale: u32, format, and| {
            let mut asked = described(label, width * scale, height * scale, format);
            asked.usage = wgpu::TextureUsages::RENDER_ATTACHMENT | and;
            card.device.create_texture(&asked)
        };
        let light = view(&make("samples", side, LIGHT, wgpu::TextureUsages::TEXTURE_BINDING));
        let samples = bind_group(card, &pipelines.light, &[wgpu::BindingResource::TextureView(&light)]);
        let means = make("pixels", 1, LIGHT, wgpu::TextureUsages::COPY_SRC);
        let row_bytes = (width * 16).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let read = card.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("pixels to read"),
            size: u64::from(row_bytes) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        Self {
            size: [width, height, side],
            depth: view(&make("distances", side, DEPTH, wgpu::TextureUsages::empty())),
            light,
            samples,
            means_view: view(&means),
            means,
            read,
            row_bytes,
        }
    }

    /// The same, if they are of that size; else others in their place.
    pub(super) fn fit<'a>(
        kept: &'a mut Option<Self>,
        card: &Card,
        pipelines: &Pipelines,
        tile: Tile,
        side: u32,
    ) -> &'a Self {
        let size = [tile.width, tile.height, side];
        if kept.as_ref().is_some_and(|t| t.size != size) {
            // the old ones' memory may be needed
            *kept = None;
        }
        kept.get_or_insert_with(|| Self::new(card, pipelines, tile.width, tile.height, side))
    }

    /// Copies the pixels from the card into a tile of a picture.
    pub(super) fn read_into(&self, card: &Card, tile: Tile, picture: &mut Picture) -> Result<(), GpuError> {
        let [width, height, _] = self.size;
        let mut encoder = card.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let rows = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(self.row_bytes), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            self.means.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &self.read, layout: rows },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        card.queue.submit([encoder.finish()]);
        let (tell, told) = std::sync::mpsc::channel();
        self.read.map_async(wgpu::MapMode::Read, .., move |result| {
            // nobody listens where waiting has failed
            let _ = tell.send(result);
        });
        card.wait()?;
        told.try_recv().map_err(|why| card.error(why))?.map_err(|why| card.error(why))?;
        let bytes = self.read.get_mapped_range(..).map_err(|why| card.error(why))?;
        for (y, row) in bytes.chunks_exact(self.row_bytes as usize).enumerate() {
            let first = (tile.top as usize + y) * picture.width + tile.left as usize;
            let pixels = &mut picture.pixels[first..first + width as usize];
            for (pixel, bytes) in pixels.iter_mut().zip(row.as_chunks::<16>().0) {
                let [r, g, b, _]: [f32; 4] = bytemuck::cast(*bytes);
                *pixel = Vec3::new(r, g, b);
            }
        }
        drop(bytes);
        self.read.unmap();
        Ok(())
    }
}

/// What stays the same from frame to frame.
pub(super) struct Stage {
    pub(super) uniform: wgpu::Buffer,
    pub(super) frame: wgpu::BindGroup,
    pub(super) sun: SunView,
}

/// Draws a tile and waits until it is done.
pub(super) fn draw(
    card: &Card,
    pipelines: &Pipelines,
    (model, stage): (&Model, &Stage),
    view: &View,
    to: &Targets,
) -> Result<(), GpuError> {
    card.queue.write_buffer(&stage.uniform, 0, bytemuck::bytes_of(&view.uniform(&stage.sun)));
    let mut encoder = card.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = begin(&mut encoder, Some(&to.light), Some((&to.depth, 0.0)));
        pass.set_bind_group(0, &stage.frame, &[]);
        model_into(&mut pass, pipelines, model, view);
        pass.set_pipeline(&pipelines.sky);
        pass.draw(0..3, 0..1);
    }
    {
        let mut pass = begin(&mut encoder, Some(&to.means_view), None);
        pass.set_bind_group(0, &stage.frame, &[]);
        pass.set_bind_group(1, &to.samples, &[]);
        pass.set_pipeline(&pipelines.mean);
        pass.draw(0..3, 0..1);
    }
    card.queue.submit([encoder.finish()]);
    card.wait()
}

/// Draws the runs of triangles that may be seen, the nearest first, which spares what lies behind them.
fn model_into(pass: &mut wgpu::RenderPass, pipelines: &Pipelines, model: &Model, view: &View) {
    let mut seen: Vec<_> = (model.runs.iter().filter(|r| view.may_show(r.low, r.high)))
        .map(|r| (view.distance2(r.low, r.high), r))
        .collect();
    if seen.is_empty() {
        return;
    }
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    pass.set_vertex_buffer(0, model.corners.slice(..));
    pass.set_vertex_buffer(1, model.irradiance.slice(..));
    // without a sun nothing looks at what it adds
    pass.set_vertex_buffer(2, model.sunlight.as_ref().unwrap_or(&model.irradiance).slice(..));
    pass.set_index_buffer(model.indices.slice(..), wgpu::IndexFormat::Uint32);
    let mut last = None;
    for (_, run) in seen {
        let picture = model.picture_of[run.material];
        if last != Some(picture) {
            pass.set_pipeline(&pipelines.model[usize::from(picture > 0)]);
            pass.set_bind_group(1, &model.pictures[picture], &[]);
            last = Some(picture);
        }
        pass.draw_indexed(3 * run.triangles.start..3 * run.triangles.end, 0, 0..1);
    }
}

/// What the sun sees of a model, drawn as `side` × `side` depths; blank without a sun.
pub(super) fn shadow(card: &Card, model: &Model, sun: Option<&SunView>, side: u32) -> wgpu::TextureView {
    let depths = card.device.create_texture(&described("what the sun sees", side, side, DEPTH));
    let depths = depths.create_view(&wgpu::TextureViewDescriptor::default());
    let Some(sun) = sun else { return depths };
    let (pipeline, layout) = shadow_pipeline(card);
    let uniform = uniform(card);
    let group = bind_group(card, &layout, &[uniform.as_entire_binding()]);
    card.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&sun.uniform()));
    let mut encoder = card.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = begin(&mut encoder, None, Some((&depths, 1.0)));
        if model.triangles > 0 {
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &group, &[]);
            pass.set_vertex_buffer(0, model.corners.slice(..));
            pass.set_index_buffer(model.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..3 * model.triangles, 0, 0..1);
        }
    }
    card.queue.submit([encoder.finish()]);
    depths
}

/// Room for what a card is told of camera and sun.
pub(super) fn uniform(card: &Card) -> wgpu::Buffer {
    card.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camera and sun"),
        size: size_of::<super::frame::Uniform>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// Begins a pass into cleared targets: black, and the farthest depth.
fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    light: Option<&wgpu::TextureView>,
    depth: Option<(&wgpu::TextureView, f32)>,
) -> wgpu::RenderPass<'a> {
    let light = light.map(|view| wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
    });
    let depth = depth.map(|(view, farthest)| wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(farthest), store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    });
    let all = [light];
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: if all[0].is_some() { &all } else { &[] },
        depth_stencil_attachment: depth,
        ..wgpu::RenderPassDescriptor::default()
    })
}

/// Runs `what` and adds its seconds to `to`.
pub(super) fn timed<T>(to: &mut f64, what: impl FnOnce() -> Result<T, GpuError>) -> Result<T, GpuError> {
    let start = Instant::now();
    let done = what();
    *to += start.elapsed().as_secs_f64();
    done
}
