//! Where a site is looked at from.

use crate::site::Site;

/// Where rays start: all probes, and the views, or those named; metres from `origin`.
pub fn eyes(site: &Site, origin: glam::DVec3, views: Option<&[&str]>) -> Vec<glam::Vec3> {
    let wanted = |name: &str| views.is_none_or(|v| v.contains(&name));
    let cameras = site.views.iter().filter(|v| wanted(&v.name)).map(|v| v.camera.pose);
    site.probes.iter().map(|p| p.pose).chain(cameras).map(|pose| (pose.position - origin).as_vec3()).collect()
}
