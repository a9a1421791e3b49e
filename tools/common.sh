# What the tools share: the repository's root, cargo, the software driver. Sourced, not run.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
command -v cargo >/dev/null || PATH="$HOME/.cargo/bin:$PATH"

# Leaves the Vulkan loader only Mesa's software driver, unless the caller has chosen drivers or a device.
choose_software_driver() {
    [[ -z ${VK_DRIVER_FILES:-}${VK_ICD_FILENAMES:-}${PHYSVIDEO_TEST_DEVICE:-} ]] || return 0
    local driver
    for driver in {/usr/share,/etc,/usr/local/share}/vulkan/icd.d/lvp_icd{."$(uname -m)",}.json; do
        if [[ -f $driver ]]; then
            # Loaders before 1.3.207 know only the second name.
            export VK_DRIVER_FILES=$driver VK_ICD_FILENAMES=$driver
            return 0
        fi
    done
}

# Every tool uses the dev profile: one build serves the tests, the demo and the benches, and the hot loops are on the
# GPU. The whole workspace is selected each time, so that cargo never builds a dependency twice for other features.
program() { cargo run --quiet --bin "$1" -- "${@:2}"; }
