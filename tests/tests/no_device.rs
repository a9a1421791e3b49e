//! A machine without a Vulkan device fails the tests with one clear sentence.

use physvideo_tests::device;

#[test]
fn a_device_opens() {
    let gpu = device::gpu();
    println!("{:?}", gpu.info);
    assert!(gpu.messages().is_empty());
}

#[test]
fn no_device_is_one_clear_sentence() {
    let out = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["a_device_opens", "--exact", "--nocapture"])
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .env("RUST_BACKTRACE", "0")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned();
    assert!(!out.status.success(), "the tests passed without a device: {said}");
    let sentence =
        said.lines().find(|l| l.starts_with("the tests need a Vulkan device and got none: no Vulkan device"));
    assert!(sentence.is_some_and(|s| s.contains("apt-get install mesa-vulkan-drivers")), "{said}");
}
