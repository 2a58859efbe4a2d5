//! Meshes of triangles.

mod support;

use splat::{Camera, Code, Image, Mesh, MeshDesc, MeshMaps, MeshRenderDesc, MeshSize};
use support::{device, Folder};

const SQUARE: MeshDesc<'_> = MeshDesc {
    flags: splat::MeshFlags(0),
    vertices: Some(&[-1.0, -1.0, 3.0, 1.0, -1.0, 3.0, 1.0, 1.0, 3.0, -1.0, 1.0, 3.0]),
    triangles: Some(&[0, 2, 1, 0, 3, 2]),
    normals: None,
    texcoords: None,
    colors: None,
    texture: None,
    texture_size: [0, 0],
    base_color: [0.0; 4],
};

#[test]
fn meshes_are_measured_and_sampled() {
    let folder = Folder::new("meshes");
    std::fs::write(folder.join("a.obj"), "v 0 0 0\nv 4 0 0\nv 4 2 0\nf 1 2 3\n").unwrap();
    let mesh = Mesh::load(folder.join("a.obj"), &Default::default()).unwrap();
    assert_eq!(mesh.get_info().unwrap().area, 4.0);
    mesh.normalise(MeshSize::UNIT_CUBE).unwrap();
    assert_eq!(mesh.get_info().unwrap().high, [0.5, 0.25, 0.0]);
    assert_eq!(mesh.sample(20, 1).unwrap()[..30], mesh.sample(10, 1).unwrap()[..]);
    assert!(mesh.load_report().unwrap().contains("warnings"));
    let missing = Mesh::load(folder.join("no.obj"), &Default::default()).unwrap_err();
    assert_eq!(missing.code(), Code::NotFound);
}

#[test]
fn meshes_are_drawn() {
    let mesh = Mesh::create(&SQUARE).unwrap();
    let camera = Camera::from_fov(16, 12, 1.1).unwrap();
    let mut color = Image::<u8>::new([16, 12], 4).unwrap();
    let mut depth = Image::<f32>::new([16, 12], 1).unwrap();
    let mut maps = [MeshMaps {
        color: Some(color.view_mut().unwrap()),
        depth: Some(depth.view_mut().unwrap()),
        ..Default::default()
    }];
    let desc = MeshRenderDesc::default();
    mesh.render(device(), &[camera], &desc, &mut maps).unwrap();
    assert!(mesh.render(device(), &[camera, camera], &desc, &mut maps).is_err());
    let middle = 6 * 16 + 8;
    assert!((depth.pixels[middle] - 3.0).abs() < 1e-5);
    assert_eq!(color.pixels[4 * middle + 3], 255);
    assert_eq!(color.pixels[3], 0);
    let none = mesh.render(device(), &[camera], &desc, &mut [MeshMaps::default()]).unwrap_err();
    assert!(none.to_string().contains("at least one map"));
}
