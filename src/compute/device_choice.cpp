#include "compute/device_choice.hpp"

#include <algorithm>
#include <charconv>

namespace hexopt::compute {

namespace {

Error usage(std::string reason) { return make_error(ErrorCode::usage, "device", "", std::move(reason)); }

std::string lower(std::string text) {
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

/// What the device lacks for the precision; empty: nothing.
std::string missing_for(const VulkanDeviceInfo& device, Precision precision) {
    if (!device.missing.empty()) return device.missing;
    return device.capabilities.supports(precision) ? "" : "double precision";
}

bool is_real_gpu(const VulkanDeviceInfo& device) {
    return device.capabilities.type <= DeviceType::virtual_gpu;
}

const VulkanDeviceInfo* best_of(const std::vector<VulkanDeviceInfo>& devices, Precision precision) {
    const VulkanDeviceInfo* best = nullptr;
    for (const VulkanDeviceInfo& device : devices) {
        if (!missing_for(device, precision).empty()) continue;
        if (!best || device.capabilities.type < best->capabilities.type) best = &device;
    }
    return best;
}

DeviceChoice choice_of(const VulkanDeviceInfo& device, std::string why) {
    return {false, device.index,
            device.capabilities.name + " (" + name_of(device.capabilities.type) + "): " + std::move(why)};
}

Result<DeviceChoice> choose_by_name(const std::string& request, Precision precision,
                                    const std::vector<VulkanDeviceInfo>& devices) {
    std::vector<const VulkanDeviceInfo*> found;
    int index = -1;
    const auto [end, error] = std::from_chars(request.data(), request.data() + request.size(), index);
    const bool is_index = error == std::errc() && end == request.data() + request.size();
    for (const VulkanDeviceInfo& device : devices)
        if (is_index ? device.index == index
                     : lower(device.capabilities.name).find(lower(request)) != std::string::npos)
            found.push_back(&device);
    if (found.empty())
        return make_error(ErrorCode::device, "device", request,
                          "there is no such device; `hexopt-gpu devices` lists them");
    if (found.size() > 1) return usage("\"" + request + "\" names several devices; give the index");
    if (const std::string missing = missing_for(*found.front(), precision); !missing.empty())
        return make_error(ErrorCode::device, "device", found.front()->capabilities.name, "lacks " + missing);
    return choice_of(*found.front(), "as asked for");
}

} // namespace

Result<DeviceChoice> choose_device(const std::string& request, Precision precision,
                                   const std::vector<VulkanDeviceInfo>& devices, const Error* absent) {
    if (request == "cpu") return DeviceChoice{true, -1, "cpu: the host's vectorised code"};
    const VulkanDeviceInfo* best = best_of(devices, precision);
    if (request == "auto") {
        if (best && is_real_gpu(*best)) return choice_of(*best, "the best GPU by type");
        if (best)
            return DeviceChoice{true, -1,
                                "cpu: the only Vulkan device is software (" + best->capabilities.name +
                                    "), which the host's own code outruns"};
        if (absent) return DeviceChoice{true, -1, "cpu: " + absent->reasons.back()};
        return DeviceChoice{true, -1,
                            devices.empty() ? "cpu: there is no Vulkan device"
                                            : "cpu: no Vulkan device has what the kernels need"};
    }
    if (absent) return *absent;
    if (request != "vulkan") return choose_by_name(request, precision, devices);
    if (best) return choice_of(*best, "the best Vulkan device by type");
    return make_error(ErrorCode::device, "device", "vulkan",
                      devices.empty()
                          ? "there is no Vulkan device; install a driver, e.g. mesa-vulkan-drivers"
                          : "no device has what the kernels need; see `hexopt-gpu devices`");
}

Result<OpenedDevice> open_device(const std::string& request, Precision precision) {
    std::vector<VulkanDeviceInfo> devices;
    Error absent;
    bool is_absent = false;
    if (request != "cpu") {
        auto listed = list_vulkan_devices();
        is_absent = !listed;
        if (listed)
            devices = std::move(*listed);
        else
            absent = listed.error();
    }
    auto choice = choose_device(request, precision, devices, is_absent ? &absent : nullptr);
    if (!choice) return choice.error();
    OpenedDevice opened;
    opened.choice = *choice;
    if (choice->use_host) return opened;
    VulkanOptions options;
    options.device_index = choice->index;
    options.cache_folder = default_cache_folder();
    auto backend = create_vulkan_backend(options);
    if (backend) {
        opened.backend = std::move(*backend);
    } else if (request == "auto") {
        opened.choice = {true, -1, "cpu: " + backend.error().one_line()};
    } else {
        return backend.error();
    }
    return opened;
}

} // namespace hexopt::compute
