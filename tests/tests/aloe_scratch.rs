use physvideo::{
    animate::Animation,
    assemble::{Inputs, assemble},
    geometry::PhotoData,
    plan::Plan,
    scene,
    stages::mpm::Method,
};
use physvideo_gpu::{Gpu, Options};

#[test]
fn aloe() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/images/aloe");
    let file = std::env::var("SCENE").unwrap_or("../assets/scenes/aloe.toml".into());
    let text = std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap();
    let mut s = scene::parse(&text, "aloe.toml").unwrap_or_else(|e| panic!("{e}"));
    let frames: u32 = std::env::var("FRAMES").ok().and_then(|f| f.parse().ok()).unwrap_or(20);
    s.output.frames = frames;
    let img = image::open(root.join("aloe.jpg")).unwrap().to_rgb8();
    let lab = image::open(root.join("aloe_objects.png")).unwrap().to_luma8();
    let dis = image::open(root.join("aloe_disparity.png")).unwrap().to_luma8();
    let photo = PhotoData {
        width: img.width(),
        height: img.height(),
        rgb: img.pixels().map(|p| p.0).collect(),
        labels: lab.pixels().map(|p| p.0[0]).collect(),
        depth: dis
            .pixels()
            .map(|p| if p.0[0] == 0 { 0.0 } else { 3740.0 * 0.16 / (f32::from(p.0[0]) + 270.0) })
            .collect(),
        focal_px: 3740.0,
        principal: [img.width() as f32 / 2.0, img.height() as f32 / 2.0],
    };
    let plan = Plan::new(&s, s.output.until);
    let t = std::time::Instant::now();
    let a = assemble(&s, &Inputs { photo: Some(photo), ..Default::default() }, &plan).unwrap();
    println!(
        "assembled {:?} particles {} pinned {} domain {:?}",
        t.elapsed(),
        a.colors.len(),
        a.world.bodies[0].pinned.iter().filter(|p| **p).count(),
        a.world.domain
    );
    let gpu = Gpu::new(Options { validation: std::env::var("VALID").is_ok(), ..Default::default() }).unwrap();
    let mut anim = Animation::new(&gpu, &s, &a, &plan, Method::default()).unwrap();
    println!("ready {:?}", t.elapsed());
    std::fs::create_dir_all("/tmp/aloe").unwrap();
    for f in 0..frames {
        let stats = anim.advance().unwrap();
        let im = anim.draw().unwrap().unwrap();
        image::save_buffer(format!("/tmp/aloe/f{f:03}.png"), &im.rgb, im.width, im.height, image::ColorType::Rgb8)
            .unwrap();
        println!("{f} {:?} {stats:?} speed {:.3}", t.elapsed(), anim.mpm.as_ref().unwrap().measure(0).unwrap().speed);
    }
    println!("{:?}", gpu.messages().first());
}
