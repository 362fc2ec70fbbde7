#pragma once

#include "compute/kernel_args.hpp"
#include "compute/kernel_info.hpp"
#include "core/context.hpp"
#include "core/result.hpp"

#include <array>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace hexopt::compute {

/// In the order of preference when a device is picked by type.
enum class DeviceType : std::uint8_t { discrete_gpu, integrated_gpu, virtual_gpu, software_gpu, other, host };
const char* name_of(DeviceType type);

struct Capabilities {
    std::string name;   ///< as the driver reports it; "cpu" for the host backend
    std::string driver; ///< driver name and version; empty for the host
    DeviceType type = DeviceType::host;
    bool f64 = true;
    std::uint64_t memory_bytes = 0; ///< largest device-local heap; 0 if unknown
    bool supports(Precision precision) const { return precision == Precision::f32 || f64; }
};

/// Makes the k-th call (from 0) of an operation fail, for tests of what happens then; -1: never.
struct Faults {
    int allocation = -1;  ///< create_buffer ends with ErrorCode::out_of_memory
    int submit = -1;      ///< submit ends with ErrorCode::device, later ones work
    int device_lost = -1; ///< submit loses the device: this and every later call fails
};

class Backend;

/// Memory of a backend, freed when this goes. The backend must outlive it.
class Buffer {
  public:
    Buffer() = default;
    Buffer(Backend* owner, std::uint32_t id, std::size_t bytes) : owner_(owner), id_(id), bytes_(bytes) {}
    Buffer(Buffer&& other) noexcept { *this = std::move(other); }
    Buffer& operator=(Buffer&& other) noexcept {
        std::swap(owner_, other.owner_), std::swap(id_, other.id_), std::swap(bytes_, other.bytes_);
        return *this;
    }
    ~Buffer();

    std::size_t bytes() const { return bytes_; }
    bool is_empty() const { return owner_ == nullptr; }
    /// For kernel arguments. offset_bytes: a multiple of 4.
    BufferRef ref(std::size_t offset_bytes = 0) const {
        return {id_, static_cast<std::uint32_t>(offset_bytes / 4)};
    }

  private:
    Backend* owner_ = nullptr;
    std::uint32_t id_ = 0;
    std::size_t bytes_ = 0;
};

/// One step of a recording.
struct Command {
    enum class Kind : std::uint8_t { dispatch, copy, fill };
    Kind kind = Kind::dispatch;
    const KernelInfo* kernel = nullptr;
    Precision precision = Precision::f64;
    std::uint32_t count = 0; ///< dispatch: work items
    std::array<std::byte, kMaxArgsBytes> args{};
    BufferRef source, target; ///< copy, fill
    std::size_t bytes = 0;    ///< copy, fill; a multiple of 4
    std::uint32_t value = 0;  ///< fill: the word to repeat
};

/// Commands to be run in order, each seeing the results of those before it.
class Recorder {
  public:
    /// Runs Args' kernel over args.count work items; none: nothing is recorded.
    template <class Args>
    void dispatch(Precision precision, const Args& args) {
        static_assert(sizeof(Args) <= kMaxArgsBytes);
        if (args.count == 0) return;
        Command command;
        command.kernel = &kernels()[Args::kKernel];
        command.precision = precision;
        command.count = args.count;
        std::memcpy(command.args.data(), &args, sizeof args);
        commands_.push_back(command);
    }
    void copy(BufferRef source, BufferRef target, std::size_t bytes);
    void fill(BufferRef target, std::uint32_t value, std::size_t bytes);
    void add(const Command& command) { commands_.push_back(command); }
    void clear() { commands_.clear(); }
    bool empty() const { return commands_.empty(); }
    const std::vector<Command>& commands() const { return commands_; }

  private:
    std::vector<Command> commands_;
};

/// Where kernels run. One thread at a time may use a backend; different backends are independent. After a
/// device is lost every call fails with ErrorCode::device, at once.
class Backend {
  public:
    virtual ~Backend() = default;
    virtual const Capabilities& capabilities() const = 0;

    /// Uninitialised memory of bytes > 0. Errors: out_of_memory, device.
    virtual Result<Buffer> create_buffer(std::size_t bytes, std::string_view label) = 0;
    /// Works in memory of the host application, which keeps it alive and idle meanwhile. native: for `cpu` a
    /// pointer, for `vulkan` a VkBuffer with storage, transfer and device-address usage.
    virtual Result<Buffer> import_buffer(void* native, std::size_t bytes) = 0;
    virtual Status upload(const Buffer& target, std::size_t offset, std::span<const std::byte> data) = 0;
    /// Waits for what was submitted before.
    virtual Status download(const Buffer& source, std::size_t offset, std::span<std::byte> data) = 0;
    /// Starts the commands; they may still run when this returns.
    virtual Status submit(const Recorder& recorder) = 0;
    /// Waits until everything submitted is done. Error: device after timeout_s seconds.
    virtual Status wait(double timeout_s = 60) = 0;

  protected:
    friend class Buffer;
    virtual void destroy_buffer(std::uint32_t id) = 0;
};

inline Buffer::~Buffer() {
    if (owner_) owner_->destroy_buffer(id_);
}

template <class T>
Result<Buffer> create_array(Backend& backend, std::span<const T> data, std::string_view label) {
    auto buffer = backend.create_buffer(std::max<std::size_t>(data.size_bytes(), 4), label);
    if (!buffer || data.empty()) return buffer;
    if (auto status = backend.upload(*buffer, 0, std::as_bytes(data)); !status) return status.error();
    return buffer;
}

template <class T>
Result<std::vector<T>> read_array(Backend& backend, const Buffer& buffer, std::size_t count,
                                  std::size_t offset_bytes = 0) {
    std::vector<T> data(count);
    if (auto status = backend.download(buffer, offset_bytes, std::as_writable_bytes(std::span<T>(data)));
        !status)
        return status.error();
    return data;
}

enum class CpuOrder {
    serial,
    scalar,   ///< over all threads, one work item after the other in each: the kernels as they are written
    parallel, ///< over all threads, several work items at once where a kernel's pack function can
    shuffled, ///< one thread, work items in a fixed random order: what depends on order shows itself
};

/// Runs kernels on the host. `parallel` is used with CpuOrder::scalar and parallel and must outlive the
/// backend.
std::unique_ptr<Backend> create_cpu_backend(const Parallel& parallel, CpuOrder order = CpuOrder::parallel,
                                            Faults faults = {});

} // namespace hexopt::compute
