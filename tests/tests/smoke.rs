//! Every kernel compiles and runs once on the device under validation.

use physvideo_gpu::{Constants, Gpu, Groups, Options, Recording};

#[test]
fn every_kernel_compiles() {
    let gpu = Gpu::new(Options { validation: true, bounds_checks: true, ..Default::default() }).unwrap();
    println!("{:?}", gpu.info);
    for kernel in physvideo_gpu::kernels::KERNELS {
        let mut rec = Recording::new("one");
        let bufs = kernel
            .bindings
            .iter()
            .map(|b| gpu.alloc::<u8>("scratch", b.name, u64::from(b.bytes)).unwrap().erase())
            .collect();
        rec.commands.push(physvideo_gpu::Command::Call {
            kernel,
            constants: Constants::none(),
            bufs,
            immediates: vec![0; kernel.immediates as usize],
            groups: Groups::Direct([0, 1, 1]),
        });
        gpu.run(&rec).unwrap();
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}
