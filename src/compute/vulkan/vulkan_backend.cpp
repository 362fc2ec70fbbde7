#include "compute/vulkan/vulkan_backend.hpp"

#include "compute/exact_spirv.hpp"
#include "compute/vulkan/device.hpp"
#include "compute/vulkan/hazards.hpp"
#include "compute/vulkan/pipeline_cache.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <unordered_map>

namespace hexopt::compute {

namespace {

constexpr std::size_t kStagingBytes = 16 << 20;
constexpr std::uint32_t kMaxGroupsX = 32768;
constexpr std::size_t kCommandBuffers = 4;
/// Blocks up to this size are kept when freed, all together up to the second one: a driver takes a tenth of a
/// millisecond for each, and solvers on small problems come and go.
constexpr std::size_t kSpareBlock = 16 << 20, kSpareBytes = 256 << 20;
constexpr double kTransferTimeout_s = 600;
constexpr VkBufferUsageFlags kUsage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT |
                                      VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                                      VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;

struct Memory {
    VkBuffer buffer = VK_NULL_HANDLE;
    VkDeviceMemory memory = VK_NULL_HANDLE; ///< null: the host application's
    VkDeviceAddress address = 0;
    std::byte* mapped = nullptr; ///< null: not visible to the host
    std::size_t bytes = 0;
};

/// Sizes that blocks are rounded to, so that spare ones fit: a quarter of the power of two below apart.
std::size_t block_bytes(std::size_t bytes) {
    const std::size_t step = std::max<std::size_t>(std::bit_floor(bytes) / 4, 256);
    return (bytes + step - 1) / step * step;
}

struct CommandBuffer {
    VkCommandBuffer handle = VK_NULL_HANDLE;
    std::uint64_t done_at = 0; ///< value of the timeline once it has run
};

class Implementation final : public VulkanBackend {
  public:
    Implementation(std::unique_ptr<VulkanDevice> device, const VulkanOptions& options)
        : device_(std::move(device)), api_(device_->api), handle_(device_->handle), options_(options),
          pipeline_cache_(*device_, options.cache_folder) {}
    ~Implementation() override;

    Status initialise();
    const Capabilities& capabilities() const override { return device_->info.capabilities; }
    std::vector<std::string> validation_messages() const override { return device_->instance->messages(); }
    Result<Buffer> create_buffer(std::size_t bytes, std::string_view label) override;
    Result<Buffer> import_buffer(void* native, std::size_t bytes) override;
    Status upload(const Buffer& target, std::size_t offset, std::span<const std::byte> data) override;
    Status download(const Buffer& source, std::size_t offset, std::span<std::byte> data) override;
    Status submit(const Recorder& recorder) override;
    Status wait(double timeout_s) override;

  protected:
    void destroy_buffer(std::uint32_t id) override;

  private:
    Status check(VkResult result, const char* call);
    Error lost_error() const;
    Result<Memory> allocate(std::size_t bytes, bool for_staging, std::string_view label);
    Result<Memory> take_block(std::size_t bytes, std::string_view label);
    void give_block(Memory& memory);
    void release_spares();
    int find_memory_type(std::uint32_t allowed, bool for_staging) const;
    void release(Memory& memory);
    Buffer add(const Memory& memory, std::size_t bytes);
    Result<CommandBuffer*> begin_commands();
    Status end_commands(CommandBuffer& commands);
    Status copy_and_wait(VkBuffer source, std::size_t from, VkBuffer target, std::size_t to,
                         std::size_t bytes);
    Status ensure_staging();
    Status record(VkCommandBuffer commands, const Command& command);
    Status record_dispatch(VkCommandBuffer commands, const Command& command);
    Result<VkPipeline> pipeline(const KernelInfo& kernel, Precision precision);
    void barrier(VkCommandBuffer commands, bool for_host) const;

    std::unique_ptr<VulkanDevice> device_;
    const DeviceApi& api_;
    VkDevice handle_;
    VulkanOptions options_;
    PipelineCache pipeline_cache_;
    VkPipelineLayout layout_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkSemaphore timeline_ = VK_NULL_HANDLE;
    std::uint64_t submitted_ = 0; ///< value of the timeline when all submitted work is done
    bool idle_ = true;
    std::vector<CommandBuffer> ring_;
    std::size_t next_in_ring_ = 0;
    std::map<std::pair<KernelId, Precision>, VkPipeline> pipelines_;
    std::unordered_map<std::uint32_t, Memory> buffers_;
    std::uint32_t last_id_ = 0;
    std::multimap<std::size_t, Memory> spares_; ///< by size
    std::size_t spare_bytes_ = 0;
    Memory staging_;
    int allocations_ = 0, submits_ = 0;
    bool lost_ = false;
};

Implementation::~Implementation() {
    if (!lost_) api_.vkDeviceWaitIdle(handle_);
    for (auto& [id, memory] : buffers_) release(memory);
    release_spares();
    release(staging_);
    for (auto& [key, pipeline] : pipelines_) api_.vkDestroyPipeline(handle_, pipeline, nullptr);
    api_.vkDestroyPipelineLayout(handle_, layout_, nullptr);
    api_.vkDestroyCommandPool(handle_, pool_, nullptr);
    api_.vkDestroySemaphore(handle_, timeline_, nullptr);
}

Error Implementation::lost_error() const {
    return make_error(ErrorCode::device, "compute", device_->info.capabilities.name,
                      "the device is lost; the driver or the system reset it");
}

Status Implementation::check(VkResult result, const char* call) {
    if (result == VK_SUCCESS) return Done{};
    if (result == VK_ERROR_DEVICE_LOST) lost_ = true;
    return vulkan_error(result, call);
}

Status Implementation::initialise() {
    VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, kMaxArgsBytes};
    VkPipelineLayoutCreateInfo layout{.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO};
    layout.pushConstantRangeCount = 1;
    layout.pPushConstantRanges = &range;
    if (auto s =
            check(api_.vkCreatePipelineLayout(handle_, &layout, nullptr, &layout_), "vkCreatePipelineLayout");
        !s)
        return s;
    VkCommandPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO};
    pool.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
    pool.queueFamilyIndex = device_->queue_family;
    if (auto s = check(api_.vkCreateCommandPool(handle_, &pool, nullptr, &pool_), "vkCreateCommandPool"); !s)
        return s;
    VkCommandBufferAllocateInfo allocate{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO};
    allocate.commandPool = pool_;
    allocate.commandBufferCount = kCommandBuffers;
    std::array<VkCommandBuffer, kCommandBuffers> handles{};
    if (auto s = check(api_.vkAllocateCommandBuffers(handle_, &allocate, handles.data()),
                       "vkAllocateCommandBuffers");
        !s)
        return s;
    for (VkCommandBuffer handle : handles) ring_.push_back({handle, 0});
    VkSemaphoreTypeCreateInfo type{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO};
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    VkSemaphoreCreateInfo semaphore{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO, .pNext = &type};
    return check(api_.vkCreateSemaphore(handle_, &semaphore, nullptr, &timeline_), "vkCreateSemaphore");
}

int Implementation::find_memory_type(std::uint32_t allowed, bool for_staging) const {
    constexpr VkMemoryPropertyFlags kHost =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    constexpr VkMemoryPropertyFlags kLocal = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    const bool discrete = device_->info.capabilities.type == DeviceType::discrete_gpu;
    std::vector<VkMemoryPropertyFlags> wishes;
    if (for_staging)
        wishes = {kHost | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, kHost};
    else if (discrete)
        wishes = {kLocal, 0};
    else
        wishes = {kLocal | kHost | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, kLocal | kHost, kLocal, 0};
    for (VkMemoryPropertyFlags wish : wishes)
        for (std::uint32_t i = 0; i < device_->memory.memoryTypeCount; ++i)
            if ((allowed >> i & 1) && (device_->memory.memoryTypes[i].propertyFlags & wish) == wish)
                return static_cast<int>(i);
    return -1;
}

Result<Memory> Implementation::allocate(std::size_t bytes, bool for_staging, std::string_view label) {
    Memory memory;
    memory.bytes = bytes;
    const auto fail = [&](Error error) {
        release(memory);
        error.where = std::string(label) + " (" + std::to_string(bytes) + " bytes)";
        return error;
    };
    VkBufferCreateInfo info{.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO};
    info.size = bytes;
    info.usage = kUsage;
    if (auto s = check(api_.vkCreateBuffer(handle_, &info, nullptr, &memory.buffer), "vkCreateBuffer"); !s)
        return fail(s.error());
    VkMemoryRequirements requirements;
    api_.vkGetBufferMemoryRequirements(handle_, memory.buffer, &requirements);
    const int type = find_memory_type(requirements.memoryTypeBits, for_staging);
    if (type < 0) return fail(vulkan_error(VK_ERROR_FEATURE_NOT_PRESENT, "memory type"));
    VkMemoryAllocateFlagsInfo flags{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO};
    flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
    VkMemoryAllocateInfo allocate_info{.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO, .pNext = &flags};
    allocate_info.allocationSize = requirements.size;
    allocate_info.memoryTypeIndex = static_cast<std::uint32_t>(type);
    if (auto s = check(api_.vkAllocateMemory(handle_, &allocate_info, nullptr, &memory.memory),
                       "vkAllocateMemory");
        !s)
        return fail(s.error());
    if (auto s =
            check(api_.vkBindBufferMemory(handle_, memory.buffer, memory.memory, 0), "vkBindBufferMemory");
        !s)
        return fail(s.error());
    const bool visible =
        device_->memory.memoryTypes[type].propertyFlags & VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    if (visible && (for_staging || !options_.force_staging)) {
        void* mapped = nullptr;
        if (auto s =
                check(api_.vkMapMemory(handle_, memory.memory, 0, VK_WHOLE_SIZE, 0, &mapped), "vkMapMemory");
            !s)
            return fail(s.error());
        memory.mapped = static_cast<std::byte*>(mapped);
    }
    VkBufferDeviceAddressInfo address{.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
    address.buffer = memory.buffer;
    memory.address = api_.vkGetBufferDeviceAddress(handle_, &address);
    return memory;
}

void Implementation::release(Memory& memory) {
    if (memory.memory || memory.address == 0) api_.vkDestroyBuffer(handle_, memory.buffer, nullptr);
    if (memory.memory) api_.vkFreeMemory(handle_, memory.memory, nullptr);
    memory = {};
}

Buffer Implementation::add(const Memory& memory, std::size_t bytes) {
    buffers_.emplace(++last_id_, memory);
    return Buffer(this, last_id_, bytes);
}

/// A spare block or a new one.
Result<Memory> Implementation::take_block(std::size_t bytes, std::string_view label) {
    bytes = block_bytes(bytes);
    if (const auto spare = spares_.find(bytes); spare != spares_.end()) {
        const Memory memory = spare->second;
        spares_.erase(spare);
        spare_bytes_ -= bytes;
        return memory;
    }
    auto memory = allocate(bytes, false, label);
    if (memory || spares_.empty() || memory.error().code != ErrorCode::out_of_memory) return memory;
    release_spares();
    return allocate(bytes, false, label);
}

void Implementation::give_block(Memory& memory) {
    const bool is_own = memory.memory != VK_NULL_HANDLE;
    if (!is_own || memory.bytes > kSpareBlock || spare_bytes_ + memory.bytes > kSpareBytes)
        return release(memory);
    spare_bytes_ += memory.bytes;
    spares_.emplace(memory.bytes, memory);
}

void Implementation::release_spares() {
    for (auto& [bytes, memory] : spares_) release(memory);
    spares_.clear();
    spare_bytes_ = 0;
}

Result<Buffer> Implementation::create_buffer(std::size_t bytes, std::string_view label) {
    if (lost_) return lost_error();
    if (allocations_++ == options_.faults.allocation) {
        Error error = vulkan_error(VK_ERROR_OUT_OF_DEVICE_MEMORY, "vkAllocateMemory");
        error.where = std::string(label) + " (" + std::to_string(bytes) + " bytes)";
        return error;
    }
    auto memory = take_block((bytes + 3) / 4 * 4, label);
    if (!memory) return memory.error();
    return add(*memory, (bytes + 3) / 4 * 4);
}

Result<Buffer> Implementation::import_buffer(void* native, std::size_t bytes) {
    if (lost_) return lost_error();
    Memory memory;
    memory.buffer = static_cast<VkBuffer>(native);
    memory.bytes = bytes;
    VkBufferDeviceAddressInfo address{.sType = VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO};
    address.buffer = memory.buffer;
    memory.address = api_.vkGetBufferDeviceAddress(handle_, &address);
    return add(memory, bytes);
}

void Implementation::destroy_buffer(std::uint32_t id) {
    if (!idle_ && !lost_) (void)wait(kTransferTimeout_s);
    const auto found = buffers_.find(id);
    give_block(found->second);
    buffers_.erase(found);
}

Status Implementation::wait(double timeout_s) {
    if (lost_) return lost_error();
    if (idle_) return Done{};
    VkSemaphoreWaitInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO};
    info.semaphoreCount = 1;
    info.pSemaphores = &timeline_;
    info.pValues = &submitted_;
    const double nanoseconds = std::clamp(timeout_s, 0.0, 1e9) * 1e9;
    auto status = check(api_.vkWaitSemaphores(handle_, &info, static_cast<std::uint64_t>(nanoseconds)),
                        "vkWaitSemaphores");
    if (status) idle_ = true;
    return status;
}

Result<CommandBuffer*> Implementation::begin_commands() {
    CommandBuffer& commands = ring_[next_in_ring_];
    next_in_ring_ = (next_in_ring_ + 1) % ring_.size();
    VkSemaphoreWaitInfo info{.sType = VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO};
    info.semaphoreCount = 1;
    info.pSemaphores = &timeline_;
    info.pValues = &commands.done_at;
    constexpr auto kNanoseconds = static_cast<std::uint64_t>(kTransferTimeout_s * 1e9);
    if (auto s = check(api_.vkWaitSemaphores(handle_, &info, kNanoseconds), "vkWaitSemaphores"); !s)
        return s.error();
    VkCommandBufferBeginInfo begin{.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO};
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    if (auto s = check(api_.vkBeginCommandBuffer(commands.handle, &begin), "vkBeginCommandBuffer"); !s)
        return s.error();
    barrier(commands.handle, false);
    return &commands;
}

Status Implementation::end_commands(CommandBuffer& commands) {
    barrier(commands.handle, true);
    if (auto s = check(api_.vkEndCommandBuffer(commands.handle), "vkEndCommandBuffer"); !s) return s;
    const std::uint64_t value = submitted_ + 1;
    VkTimelineSemaphoreSubmitInfo timeline{.sType = VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO};
    timeline.signalSemaphoreValueCount = 1;
    timeline.pSignalSemaphoreValues = &value;
    VkSubmitInfo info{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO, .pNext = &timeline};
    info.commandBufferCount = 1;
    info.pCommandBuffers = &commands.handle;
    info.signalSemaphoreCount = 1;
    info.pSignalSemaphores = &timeline_;
    if (device_->lock) device_->lock();
    const VkResult result = api_.vkQueueSubmit(device_->queue, 1, &info, VK_NULL_HANDLE);
    if (device_->unlock) device_->unlock();
    if (auto s = check(result, "vkQueueSubmit"); !s) return s;
    submitted_ = commands.done_at = value;
    idle_ = false;
    return Done{};
}

void Implementation::barrier(VkCommandBuffer commands, bool for_host) const {
    constexpr VkPipelineStageFlags kWork =
        VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
    VkMemoryBarrier memory{.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER};
    memory.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
    constexpr VkAccessFlags kAnyWork = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                                       VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
    memory.dstAccessMask = for_host ? VkAccessFlags{VK_ACCESS_HOST_READ_BIT} : kAnyWork;
    api_.vkCmdPipelineBarrier(commands, kWork,
                              for_host ? VkPipelineStageFlags{VK_PIPELINE_STAGE_HOST_BIT} : kWork, 0, 1,
                              &memory, 0, nullptr, 0, nullptr);
}

Status Implementation::copy_and_wait(VkBuffer source, std::size_t from, VkBuffer target, std::size_t to,
                                     std::size_t bytes) {
    auto commands = begin_commands();
    if (!commands) return commands.error();
    const VkBufferCopy region{from, to, bytes};
    api_.vkCmdCopyBuffer((*commands)->handle, source, target, 1, &region);
    if (auto s = end_commands(**commands); !s) return s;
    return wait(kTransferTimeout_s);
}

Status Implementation::ensure_staging() {
    if (staging_.buffer) return Done{};
    auto memory = allocate(kStagingBytes, true, "staging");
    if (!memory) return memory.error();
    staging_ = *memory;
    return Done{};
}

// Copies come after what was submitted before by themselves; only the host has to wait for it.
Status Implementation::upload(const Buffer& target, std::size_t offset, std::span<const std::byte> data) {
    if (lost_) return lost_error();
    const Memory& memory = buffers_.at(target.ref().buffer);
    if (memory.mapped) {
        if (auto s = wait(kTransferTimeout_s); !s) return s;
        std::copy(data.begin(), data.end(), memory.mapped + offset);
        return Done{};
    }
    if (auto s = ensure_staging(); !s) return s;
    for (std::size_t at = 0; at < data.size(); at += kStagingBytes) {
        const std::size_t part = std::min(kStagingBytes, data.size() - at);
        std::copy_n(data.begin() + at, part, staging_.mapped);
        if (auto s = copy_and_wait(staging_.buffer, 0, memory.buffer, offset + at, part); !s) return s;
    }
    return Done{};
}

Status Implementation::download(const Buffer& source, std::size_t offset, std::span<std::byte> data) {
    if (lost_) return lost_error();
    const Memory& memory = buffers_.at(source.ref().buffer);
    if (memory.mapped) {
        if (auto s = wait(kTransferTimeout_s); !s) return s;
        std::copy_n(memory.mapped + offset, data.size(), data.begin());
        return Done{};
    }
    if (auto s = ensure_staging(); !s) return s;
    for (std::size_t at = 0; at < data.size(); at += kStagingBytes) {
        const std::size_t part = std::min(kStagingBytes, data.size() - at);
        if (auto s = copy_and_wait(memory.buffer, offset + at, staging_.buffer, 0, part); !s) return s;
        std::copy_n(staging_.mapped, part, data.begin() + at);
    }
    return Done{};
}

Result<VkPipeline> Implementation::pipeline(const KernelInfo& kernel, Precision precision) {
    VkPipeline& entry = pipelines_[{kernel.id, precision}];
    if (entry) return entry;
    const std::vector<std::uint32_t> code = forbid_contraction(kernel.spirv[static_cast<int>(precision)]);
    VkShaderModuleCreateInfo module_info{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO};
    module_info.codeSize = code.size() * sizeof code[0];
    module_info.pCode = code.data();
    VkComputePipelineCreateInfo info{.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO};
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.pName = "main";
    const VkBool32 refined = capabilities().type != DeviceType::software_gpu; // shaders/dialect/types.glsl
    const VkSpecializationMapEntry constant{.constantID = 0, .offset = 0, .size = sizeof refined};
    const VkSpecializationInfo constants{
        .mapEntryCount = 1, .pMapEntries = &constant, .dataSize = sizeof refined, .pData = &refined};
    info.stage.pSpecializationInfo = &constants;
    info.layout = layout_;
    if (auto s = check(api_.vkCreateShaderModule(handle_, &module_info, nullptr, &info.stage.module),
                       "vkCreateShaderModule");
        !s)
        return s.error();
    auto status =
        check(api_.vkCreateComputePipelines(handle_, pipeline_cache_.handle(), 1, &info, nullptr, &entry),
              "vkCreateComputePipelines");
    api_.vkDestroyShaderModule(handle_, info.stage.module, nullptr);
    if (!status) return status.error();
    return entry;
}

Status Implementation::record_dispatch(VkCommandBuffer commands, const Command& command) {
    const KernelInfo& kernel = *command.kernel;
    if (!capabilities().supports(command.precision))
        return make_error(ErrorCode::device, "compute", capabilities().name,
                          "no double precision on this device; use --precision f32");
    auto handle = pipeline(kernel, command.precision);
    if (!handle) return handle.error();
    std::array<std::byte, kMaxArgsBytes> args = command.args;
    for (const ArgInfo& arg : kernel.args) {
        if (!arg.is_buffer) continue;
        BufferRef ref;
        std::memcpy(&ref, args.data() + arg.offset, sizeof ref);
        const std::uint64_t address =
            ref.buffer ? buffers_.at(ref.buffer).address + std::uint64_t{ref.offset} * 4 : 0;
        std::memcpy(args.data() + arg.offset, &address, sizeof address);
    }
    api_.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, *handle);
    api_.vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0,
                            (kernel.args_bytes + 3) / 4 * 4, args.data());
    const std::uint32_t groups =
        kernel.cooperative ? command.count : (command.count - 1) / kernel.local_size + 1;
    const std::uint32_t x = std::min(groups, kMaxGroupsX);
    api_.vkCmdDispatch(commands, x, (groups - 1) / x + 1, 1);
    return Done{};
}

Status Implementation::record(VkCommandBuffer commands, const Command& command) {
    if (command.kind == Command::Kind::dispatch) return record_dispatch(commands, command);
    const VkBuffer target = buffers_.at(command.target.buffer).buffer;
    const VkDeviceSize to = VkDeviceSize{command.target.offset} * 4;
    if (command.kind == Command::Kind::copy) {
        const VkBufferCopy region{VkDeviceSize{command.source.offset} * 4, to, command.bytes};
        api_.vkCmdCopyBuffer(commands, buffers_.at(command.source.buffer).buffer, target, 1, &region);
    } else {
        api_.vkCmdFillBuffer(commands, target, to, command.bytes, command.value);
    }
    return Done{};
}

Status Implementation::submit(const Recorder& recorder) {
    if (lost_) return lost_error();
    const int number = submits_++;
    if (number == options_.faults.device_lost) {
        lost_ = true;
        return lost_error();
    }
    if (number == options_.faults.submit) return vulkan_error(VK_ERROR_OUT_OF_HOST_MEMORY, "vkQueueSubmit");
    if (recorder.empty()) return Done{};
    auto commands = begin_commands();
    if (!commands) return commands.error();
    Hazards hazards;
    for (const Command& command : recorder.commands()) {
        if (hazards.needs_barrier(command)) barrier((*commands)->handle, false);
        if (auto s = record((*commands)->handle, command); !s) {
            api_.vkEndCommandBuffer((*commands)->handle);
            return s;
        }
    }
    return end_commands(**commands);
}

} // namespace

Result<std::unique_ptr<VulkanBackend>> create_vulkan_backend(const VulkanOptions& options) {
    auto instance = options.external.device ? VulkanInstance::adopt(options.external)
                                            : VulkanInstance::create(options.validation);
    if (!instance) return instance.error();
    auto device = VulkanDevice::create(std::move(*instance), options);
    if (!device) return device.error();
    auto backend = std::make_unique<Implementation>(std::move(*device), options);
    if (auto status = backend->initialise(); !status) return status.error();
    return std::unique_ptr<VulkanBackend>(std::move(backend));
}

} // namespace hexopt::compute
