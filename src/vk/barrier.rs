//! Every barrier of the program.
//!
//! Passes run one after the other on one queue, so a single memory barrier at the end of each is exact enough: it costs
//! 0.02 µs when nothing is in flight on the software rasteriser (docs/lavapipe.md) and it cannot be forgotten. That
//! matters because synchronisation validation does not track the attachments of dynamic rendering: a clean run proves
//! nothing there.

use super::image::Image;
use ash::vk;

/// Makes everything written so far visible to everything after it, on the device and on the host.
pub(super) fn full(device: &ash::Device, commands: vk::CommandBuffer) {
    let barrier = vk::MemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS | vk::PipelineStageFlags2::HOST)
        .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
    let barriers = [barrier];
    // SAFETY: `commands` is being recorded, outside a rendering scope.
    unsafe { device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().memory_barriers(&barriers)) };
}

/// Moves a new image to the one layout it keeps; its contents become undefined.
pub(super) fn first_use(device: &ash::Device, commands: vk::CommandBuffer, image: &Image) {
    change_layout(device, commands, image, [vk::ImageLayout::UNDEFINED, image.layout()]);
}

/// Moves an image from one layout to another, after everything before and before everything after.
pub(super) fn change_layout(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: &Image,
    [from, to]: [vk::ImageLayout; 2],
) {
    transition(device, commands, (image.raw, image.whole()), [from, to]);
}

/// Moves an image of a window from one layout to another, after everything before and ahead of everything after.
pub(super) fn window_image(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    image: vk::Image,
    [from, to]: [vk::ImageLayout; 2],
) {
    let whole =
        vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
    transition(device, commands, (image, whole), [from, to]);
}

/// Moves part of an image that is alive from one layout to another.
fn transition(
    device: &ash::Device,
    commands: vk::CommandBuffer,
    (image, part): (vk::Image, vk::ImageSubresourceRange),
    [from, to]: [vk::ImageLayout; 2],
) {
    let barrier = vk::ImageMemoryBarrier2::default()
        .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
        .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
        .old_layout(from)
        .new_layout(to)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .image(image)
        .subresource_range(part);
    let barriers = [barrier];
    // SAFETY: `commands` is being recorded, outside a rendering scope; the image is alive.
    unsafe { device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().image_memory_barriers(&barriers)) };
}
