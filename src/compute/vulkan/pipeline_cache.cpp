#include "compute/vulkan/pipeline_cache.hpp"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>
#include <unistd.h>

namespace hexopt::compute {

namespace {

// The file: this header, then the driver's data. Drivers trust their data, so its integrity is checked here.
struct Header {
    char magic[8];
    std::uint64_t bytes;
    std::uint64_t hash;
};
constexpr char kMagic[9] = "HXPIPE01";

std::uint64_t fnv1a(const std::vector<char>& data) {
    std::uint64_t hash = 14695981039346656037u;
    for (char c : data) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
    return hash;
}

std::vector<char> read_checked(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> all((std::istreambuf_iterator<char>(file)), {});
    Header header;
    if (all.size() < sizeof header) return {};
    std::memcpy(&header, all.data(), sizeof header);
    std::vector<char> data(all.begin() + sizeof header, all.end());
    const bool intact = std::memcmp(header.magic, kMagic, 8) == 0 && header.bytes == data.size() &&
                        header.hash == fnv1a(data);
    return intact ? data : std::vector<char>{};
}

std::string file_name(const InstanceApi& api, VkPhysicalDevice device) {
    VkPhysicalDeviceProperties2 properties{.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    api.vkGetPhysicalDeviceProperties2(device, &properties);
    std::string name = "pipelines-";
    constexpr char kDigits[] = "0123456789abcdef";
    for (std::uint8_t byte : properties.properties.pipelineCacheUUID) {
        name += kDigits[byte >> 4];
        name += kDigits[byte & 15];
    }
    return name + ".bin";
}

} // namespace

PipelineCache::PipelineCache(const VulkanDevice& device, const std::string& folder) : device_(device) {
    std::vector<char> data;
    if (!folder.empty()) {
        path_ = folder + "/" + file_name(device.instance->api(), device.physical);
        data = read_checked(path_);
        loaded_hash_ = fnv1a(data);
    }
    VkPipelineCacheCreateInfo info{.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO};
    info.initialDataSize = data.size();
    info.pInitialData = data.data();
    if (device.api.vkCreatePipelineCache(device.handle, &info, nullptr, &cache_) != VK_SUCCESS)
        cache_ = VK_NULL_HANDLE;
}

PipelineCache::~PipelineCache() {
    if (!cache_) return;
    if (!path_.empty()) save();
    device_.api.vkDestroyPipelineCache(device_.handle, cache_, nullptr);
}

void PipelineCache::save() const {
    std::size_t size = 0;
    if (device_.api.vkGetPipelineCacheData(device_.handle, cache_, &size, nullptr) != VK_SUCCESS) return;
    std::vector<char> data(size);
    if (device_.api.vkGetPipelineCacheData(device_.handle, cache_, &size, data.data()) != VK_SUCCESS) return;
    data.resize(size);
    Header header{};
    std::memcpy(header.magic, kMagic, 8);
    header.bytes = data.size();
    header.hash = fnv1a(data);
    if (header.hash == loaded_hash_) return;
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path(path_).parent_path(), ignored);
    // A name of its own for each process and thread, since several may save at once.
    const std::string temporary = path_ + "." + std::to_string(getpid()) + "." +
                                  std::to_string(std::hash<std::thread::id>{}(std::this_thread::get_id()));
    std::ofstream file(temporary, std::ios::binary);
    file.write(reinterpret_cast<const char*>(&header), sizeof header);
    file.write(data.data(), static_cast<std::streamsize>(data.size()));
    file.close();
    if (file) std::filesystem::rename(temporary, path_, ignored);
    if (!file || ignored) std::filesystem::remove(temporary, ignored);
}

std::string default_cache_folder() {
    if (const char* folder = std::getenv("XDG_CACHE_HOME"); folder && *folder)
        return std::string(folder) + "/hexopt-gpu";
    if (const char* home = std::getenv("HOME"); home && *home)
        return std::string(home) + "/.cache/hexopt-gpu";
    return {};
}

} // namespace hexopt::compute
