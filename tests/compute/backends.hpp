#pragma once

#include "compute/vulkan/vulkan_backend.hpp"

#include <catch2/catch.hpp>
#include <iostream>

namespace hexopt::compute::testing {

/// A Vulkan backend with the validation layer, whose messages fail the test when this goes; or none, said
/// aloud.
class ValidatedVulkan {
  public:
    explicit ValidatedVulkan(VulkanOptions options = {}) {
        options.validation = true;
        if (options.cache_folder.empty()) options.cache_folder = HEXOPT_BINARY_DIR "/pipeline-cache";
        auto created = create_vulkan_backend(options);
        if (!created) {
            options.validation = false;
            created = create_vulkan_backend(options);
        }
        if (created)
            backend_ = std::move(*created);
        else
            WARN("SKIPPED: " << created.error().one_line());
    }
    ~ValidatedVulkan() {
        if (!backend_) return;
        for (const std::string& message : backend_->validation_messages()) {
            UNSCOPED_INFO(message);
            CHECK(message.empty());
        }
    }
    explicit operator bool() const { return backend_ != nullptr; }
    VulkanBackend& operator*() const { return *backend_; }
    VulkanBackend* operator->() const { return backend_.get(); }

  private:
    std::unique_ptr<VulkanBackend> backend_;
};

} // namespace hexopt::compute::testing
