//! Which way the pixels of an eye look.

use clerestory::panorama::Projection;
use clerestory::reference::Eye;
use clerestory::scene::Scene;
use glam::{DVec3, Vec3};

/// The direction that pixel coordinates look along, program's axes.
pub fn direction(eye: &Eye, x: f64, y: f64) -> Vec3 {
    match eye {
        Eye::Camera(camera) => camera.direction(x, y).as_vec3(),
        Eye::Panorama { pose, width, height } => {
            let d = Projection::LatLong.direction(*width, *height, x, y).unwrap_or(DVec3::Y);
            (pose.rotation * d).as_vec3()
        }
    }
}

/// Where an eye stands, local metres.
pub fn origin(scene: &Scene, eye: &Eye) -> Vec3 {
    match eye {
        Eye::Camera(camera) => scene.local(camera.pose.position),
        Eye::Panorama { pose, .. } => scene.local(pose.position),
    }
}
