#pragma once

/// From the next vkQueueSubmit on, its queue is that of a lost device: every submit to it fails. A
/// device that is opened later works. Replaces functions of the Vulkan loader: linked before the
/// library under test, or by LD_PRELOAD.
extern "C" void lose_vulkan_device();
