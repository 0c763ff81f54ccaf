#pragma once

/// The queue of the next vkQueueSubmit is lost from then on, as that of a lost device is: every
/// submit to it fails. A device that is opened later is sound. In front of the Vulkan loader:
/// linked before the library under test, or by LD_PRELOAD.
extern "C" void lose_vulkan_device();
