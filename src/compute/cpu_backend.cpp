#include "compute/backend.hpp"
#include "compute/flush_denormals.hpp"
#include "compute/host_packs.hpp"

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace hexopt::compute {

namespace {

constexpr std::size_t kChunk = 512; ///< work items a thread takes at a time
constexpr std::size_t kAlignment = 64;

struct Block {
    std::byte* data = nullptr;
    std::size_t bytes = 0;
    std::unique_ptr<std::byte[]> owned;
};

Error lost_error() {
    return make_error(ErrorCode::device, "compute", "cpu", "the device is lost (injected)");
}

class CpuBackend final : public Backend {
  public:
    CpuBackend(const Parallel& parallel, CpuOrder order, Faults faults)
        : parallel_(parallel), order_(order), faults_(faults) {
        capabilities_.name = "cpu";
    }

    const Capabilities& capabilities() const override { return capabilities_; }

    Result<Buffer> create_buffer(std::size_t bytes, std::string_view label) override {
        if (lost_) return lost_error();
        Block block;
        block.bytes = bytes;
        if (allocations_++ != faults_.allocation)
            block.owned.reset(new (std::nothrow) std::byte[bytes + kAlignment]);
        if (!block.owned)
            return make_error(ErrorCode::out_of_memory, "compute", std::string(label),
                              "no memory for " + std::to_string(bytes) + " bytes");
        const auto address = reinterpret_cast<std::uintptr_t>(block.owned.get());
        block.data = block.owned.get() + (kAlignment - address % kAlignment) % kAlignment;
        return add(std::move(block));
    }

    Result<Buffer> import_buffer(void* native, std::size_t bytes) override {
        if (lost_) return lost_error();
        return add(Block{static_cast<std::byte*>(native), bytes, nullptr});
    }

    Status upload(const Buffer& target, std::size_t offset, std::span<const std::byte> data) override {
        if (lost_) return lost_error();
        std::copy(data.begin(), data.end(), address(target.ref()) + offset);
        return Done{};
    }

    Status download(const Buffer& source, std::size_t offset, std::span<std::byte> data) override {
        if (lost_) return lost_error();
        const std::byte* from = address(source.ref()) + offset;
        std::copy(from, from + data.size(), data.begin());
        return Done{};
    }

    Status submit(const Recorder& recorder) override {
        const int number = submits_++;
        if (number == faults_.device_lost) lost_ = true;
        if (lost_) return lost_error();
        if (number == faults_.submit)
            return make_error(ErrorCode::device, "compute", "cpu", "submission failed (injected)");
        for (const Command& command : recorder.commands()) run(command);
        return Done{};
    }

    Status wait(double) override {
        if (lost_) return lost_error();
        return Done{};
    }

  protected:
    void destroy_buffer(std::uint32_t id) override { blocks_.erase(id); }

  private:
    Buffer add(Block block) {
        const std::size_t bytes = block.bytes;
        blocks_.emplace(++last_id_, std::move(block));
        return Buffer(this, last_id_, bytes);
    }

    std::byte* address(BufferRef ref) const {
        if (ref.buffer == 0) return nullptr;
        return blocks_.at(ref.buffer).data + std::size_t{ref.offset} * 4;
    }

    void run(const Command& command) {
        if (command.kind == Command::Kind::copy) {
            std::memmove(address(command.target), address(command.source), command.bytes);
        } else if (command.kind == Command::Kind::fill) {
            for (std::size_t i = 0; i < command.bytes; i += 4)
                std::memcpy(address(command.target) + i, &command.value, 4);
        } else {
            dispatch(command);
        }
    }

    void dispatch(const Command& command) {
        alignas(8) std::array<std::byte, kMaxArgsBytes> args = command.args;
        for (const ArgInfo& arg : command.kernel->args) {
            if (!arg.is_buffer) continue;
            BufferRef ref;
            std::memcpy(&ref, args.data() + arg.offset, sizeof ref);
            const std::byte* pointer = address(ref);
            std::memcpy(args.data() + arg.offset, &pointer, sizeof pointer);
        }
        const HostFunction function = command.kernel->host[static_cast<int>(command.precision)];
        if (order_ == CpuOrder::shuffled) {
            const FlushDenormals flush;
            function(args.data(), 0, command.count, shuffled(command.count));
        } else if (order_ == CpuOrder::serial) {
            const FlushDenormals flush;
            function(args.data(), 0, command.count, nullptr);
        } else {
            const PackFunction packs =
                order_ == CpuOrder::parallel ? pack_function(*command.kernel) : nullptr;
            const std::size_t chunk = command.kernel->cooperative ? 1 : kChunk;
            parallel_.for_chunks(command.count, chunk, [&](std::size_t begin, std::size_t end) {
                const FlushDenormals flush;
                const auto first = static_cast<std::uint32_t>(begin), last = static_cast<std::uint32_t>(end);
                if (packs)
                    packs(command.precision, function, args.data(), first, last);
                else
                    function(args.data(), first, last, nullptr);
            });
        }
    }

    const std::uint32_t* shuffled(std::uint32_t count) {
        permutation_.resize(count);
        std::iota(permutation_.begin(), permutation_.end(), 0u);
        std::uint64_t state = 0x9e3779b97f4a7c15u + shuffles_++;
        for (std::uint32_t i = count; i > 1; --i) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            std::swap(permutation_[i - 1], permutation_[(state >> 33) % i]);
        }
        return permutation_.data();
    }

    const Parallel& parallel_;
    CpuOrder order_;
    Faults faults_;
    Capabilities capabilities_;
    std::unordered_map<std::uint32_t, Block> blocks_;
    std::vector<std::uint32_t> permutation_;
    std::uint32_t last_id_ = 0;
    std::uint64_t shuffles_ = 0;
    int allocations_ = 0, submits_ = 0;
    bool lost_ = false;
};

} // namespace

std::unique_ptr<Backend> create_cpu_backend(const Parallel& parallel, CpuOrder order, Faults faults) {
    return std::make_unique<CpuBackend>(parallel, order, faults);
}

} // namespace hexopt::compute
