#include "compute/vulkan/vulkan_api.hpp"

#include <dlfcn.h>

namespace hexopt::compute {

bool InstanceApi::load(PFN_vkGetInstanceProcAddr get, VkInstance instance) {
    vkGetInstanceProcAddr = get;
    bool complete = true;
#define X(name)                                                                                              \
    name = reinterpret_cast<PFN_##name>(get(instance, #name));                                               \
    complete = complete && name;
    HEXOPT_VK_INSTANCE_FUNCTIONS(X)
#undef X
    return complete;
}

bool DeviceApi::load(const InstanceApi& api, VkDevice device) {
    bool complete = true;
#define X(name)                                                                                              \
    name = reinterpret_cast<PFN_##name>(api.vkGetDeviceProcAddr(device, #name));                             \
    complete = complete && name;
    HEXOPT_VK_DEVICE_FUNCTIONS(X)
#undef X
    return complete;
}

Result<VulkanLoader> load_vulkan() {
    static void* const library = dlopen("libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
    void* symbol = library ? dlsym(library, "vkGetInstanceProcAddr") : nullptr;
    if (!symbol)
        return make_error(ErrorCode::device, "compute", "libvulkan.so.1",
                          "no Vulkan loader on this machine; install libvulkan1 and a driver");
    return VulkanLoader{reinterpret_cast<PFN_vkGetInstanceProcAddr>(symbol)};
}

Error vulkan_error(VkResult result, const char* call) {
    const char* reason = "failed";
    ErrorCode code = ErrorCode::device;
    switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
        code = ErrorCode::out_of_memory;
        reason = "out of host memory";
        break;
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
        code = ErrorCode::out_of_memory;
        reason = "out of device memory";
        break;
    case VK_ERROR_DEVICE_LOST:
        reason = "the device is lost";
        break;
    case VK_ERROR_INITIALIZATION_FAILED:
        reason = "initialization failed";
        break;
    case VK_ERROR_INCOMPATIBLE_DRIVER:
        reason = "no compatible driver";
        break;
    case VK_ERROR_LAYER_NOT_PRESENT:
        reason = "the validation layer is not installed";
        break;
    case VK_ERROR_FEATURE_NOT_PRESENT:
        reason = "a feature is missing";
        break;
    case VK_TIMEOUT:
        reason = "timed out";
        break;
    default:
        break;
    }
    return make_error(code, "compute", call, std::string(reason) + " (" + std::to_string(result) + ")");
}

} // namespace hexopt::compute
