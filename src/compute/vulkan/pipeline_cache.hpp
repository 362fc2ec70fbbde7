#pragma once

#include "compute/vulkan/device.hpp"

namespace hexopt::compute {

/// VkPipelineCache kept in a file, one a device and driver. A damaged or foreign file counts as empty;
/// failures to write are ignored: the cache only saves time.
class PipelineCache {
  public:
    PipelineCache(const VulkanDevice& device, const std::string& folder);
    ~PipelineCache(); ///< saves, where something was added
    PipelineCache(const PipelineCache&) = delete;
    PipelineCache& operator=(const PipelineCache&) = delete;

    VkPipelineCache handle() const { return cache_; }
    const std::string& path() const { return path_; }

  private:
    void save() const;
    const VulkanDevice& device_;
    std::string path_;
    VkPipelineCache cache_ = VK_NULL_HANDLE;
    std::uint64_t loaded_hash_ = 0;
};

} // namespace hexopt::compute
