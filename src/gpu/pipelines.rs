//! The programs that a card runs, and what each is given.

use std::mem::offset_of;
use wgpu::{BindingType, ShaderStages, VertexFormat, VertexStepMode};

use super::device::Card;
use super::upload::{Corner, bind_group};

/// Radiance is kept as it is, from the faintest to the brightest.
pub(super) const LIGHT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;

/// Distances, the nearest the largest: floats are finest near 0, where far ones lie.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The programs that a card runs.
pub(super) struct Pipelines {
    pub(super) frame: wgpu::BindGroupLayout,
    pub(super) light: wgpu::BindGroupLayout,
    /// Triangles without a picture, and with one.
    pub(super) model: [wgpu::RenderPipeline; 2],
    pub(super) sky: wgpu::RenderPipeline,
    pub(super) mean: wgpu::RenderPipeline,
}

/// A picture and its sampler.
pub(super) fn picture_layout(card: &Card) -> wgpu::BindGroupLayout {
    let sampler = BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    layout(card, &[texture(wgpu::TextureSampleType::Float { filterable: true }), sampler])
}

impl Pipelines {
    /// For a model whose sun is kept apart, or not.
    pub(super) fn new(card: &Card, picture: &wgpu::BindGroupLayout, sun: bool) -> Self {
        let shader = shader(card);
        let plain = texture(wgpu::TextureSampleType::Float { filterable: false });
        let shadow =
            [texture(wgpu::TextureSampleType::Depth), BindingType::Sampler(wgpu::SamplerBindingType::Comparison)];
        let frame = layout(card, &[UNIFORM, plain, shadow[0], shadow[1]]);
        let light = layout(card, &[plain]);
        let model = [false, true].map(|textured| {
            let constants = [("TEXTURED", f64::from(u8::from(textured))), ("SUN", f64::from(u8::from(sun)))];
            let own = Program {
                vertex: "corner",
                fragment: Some("radiance"),
                constants: &constants,
                buffers: &BUFFERS,
                layouts: &[Some(&frame), Some(picture)],
                cull: true,
                depth: Some((true, wgpu::CompareFunction::Greater, wgpu::DepthBiasState::default())),
            };
            own.pipeline(card, &shader)
        });
        let behind = Some((false, wgpu::CompareFunction::GreaterEqual, wgpu::DepthBiasState::default()));
        let over_all = |fragment, layouts, depth| {
            Program { fragment: Some(fragment), layouts, depth, ..Program::OVER_ALL }.pipeline(card, &shader)
        };
        let layouts = [Some(&frame), Some(&light)];
        let sky = over_all("sky_radiance", &layouts[..1], behind);
        let mean = over_all("mean", &layouts, None);
        Self { frame, light, model, sky, mean }
    }
}

/// What draws the depths that the sun sees, and the layout of what it is given.
pub(super) fn shadow_pipeline(card: &Card) -> (wgpu::RenderPipeline, wgpu::BindGroupLayout) {
    let frame = layout(card, &[UNIFORM]);
    // what casts shadows a little nearer to the sun: no light where walls meet
    let bias = wgpu::DepthBiasState { constant: -2, slope_scale: -0.5, clamp: 0.0 };
    let program = Program {
        vertex: "sun_corner",
        fragment: None,
        buffers: &BUFFERS[..1],
        layouts: &[Some(&frame)],
        depth: Some((true, wgpu::CompareFunction::Less, bias)),
        ..Program::OVER_ALL
    };
    (program.pipeline(card, &shader(card)), frame)
}

fn shader(card: &Card) -> wgpu::ShaderModule {
    card.device.create_shader_module(wgpu::include_wgsl!("shader.wgsl"))
}

const UNIFORM: BindingType =
    BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None };

const fn texture(sample_type: wgpu::TextureSampleType) -> BindingType {
    BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false }
}

/// A layout of resources 0, 1, 2, …
fn layout(card: &Card, types: &[BindingType]) -> wgpu::BindGroupLayout {
    let entries: Vec<wgpu::BindGroupLayoutEntry> = (0..)
        .zip(types)
        .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: ShaderStages::VERTEX_FRAGMENT,
            ty,
            count: None,
        })
        .collect();
    card.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// Vertices, their light, and what the sun adds.
const BUFFERS: [Option<wgpu::VertexBufferLayout>; 3] = {
    const fn three_floats(shader_location: u32, offset: usize) -> wgpu::VertexAttribute {
        wgpu::VertexAttribute { format: VertexFormat::Float32x3, offset: offset as u64, shader_location }
    }
    const fn buffer(wide: usize, attributes: &[wgpu::VertexAttribute]) -> Option<wgpu::VertexBufferLayout<'_>> {
        Some(wgpu::VertexBufferLayout { array_stride: wide as u64, step_mode: VertexStepMode::Vertex, attributes })
    }
    const UV: wgpu::VertexAttribute = wgpu::VertexAttribute {
        format: VertexFormat::Float32x2,
        offset: offset_of!(Corner, uv) as u64,
        shader_location: 1,
    };
    const LIGHT_BYTES: usize = size_of::<[f32; 3]>();
    [
        buffer(
            size_of::<Corner>(),
            &[three_floats(0, offset_of!(Corner, at)), UV, three_floats(2, offset_of!(Corner, reflectance))],
        ),
        buffer(LIGHT_BYTES, &[three_floats(3, 0)]),
        buffer(LIGHT_BYTES, &[three_floats(4, 0)]),
    ]
};

/// What makes up a program.
struct Program<'a> {
    vertex: &'a str,
    fragment: Option<&'a str>,
    constants: &'a [(&'a str, f64)],
    buffers: &'a [Option<wgpu::VertexBufferLayout<'a>>],
    layouts: &'a [Option<&'a wgpu::BindGroupLayout>],
    /// Leaves back faces out.
    cull: bool,
    /// Whether depths are written, which pass, and what is added to them.
    depth: Option<(bool, wgpu::CompareFunction, wgpu::DepthBiasState)>,
}

impl Program<'_> {
    const OVER_ALL: Self = Self {
        vertex: "whole_picture",
        fragment: None,
        constants: &[],
        buffers: &[],
        layouts: &[],
        cull: false,
        depth: None,
    };

    fn pipeline(&self, card: &Card, module: &wgpu::ShaderModule) -> wgpu::RenderPipeline {
        let options = wgpu::PipelineCompilationOptions { constants: self.constants, ..Default::default() };
        let layout =
            wgpu::PipelineLayoutDescriptor { label: None, bind_group_layouts: self.layouts, immediate_size: 0 };
        let targets = [Some(wgpu::ColorTargetState { format: LIGHT, blend: None, write_mask: wgpu::ColorWrites::ALL })];
        card.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: self.fragment.or(Some(self.vertex)),
            layout: Some(&card.device.create_pipeline_layout(&layout)),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(self.vertex),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: self.buffers,
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: self.cull.then_some(wgpu::Face::Back),
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: self.depth.map(|(write, compare, bias)| wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(write),
                depth_compare: Some(compare),
                stencil: wgpu::StencilState::default(),
                bias,
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: self.fragment.map(|entry| wgpu::FragmentState {
                module,
                entry_point: Some(entry),
                compilation_options: options,
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

/// The resources of a frame: what is known of camera and sun, the sky, and what the sun sees.
pub(super) fn frame_group(
    card: &Card,
    layout: &wgpu::BindGroupLayout,
    uniform: &wgpu::Buffer,
    sky: &wgpu::TextureView,
    shadow: &wgpu::TextureView,
) -> wgpu::BindGroup {
    let nearer = card.device.create_sampler(&wgpu::SamplerDescriptor {
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        compare: Some(wgpu::CompareFunction::LessEqual),
        ..wgpu::SamplerDescriptor::default()
    });
    let resources = [
        uniform.as_entire_binding(),
        wgpu::BindingResource::TextureView(sky),
        wgpu::BindingResource::TextureView(shadow),
        wgpu::BindingResource::Sampler(&nearer),
    ];
    bind_group(card, layout, &resources)
}
