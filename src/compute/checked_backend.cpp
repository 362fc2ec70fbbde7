#include "compute/checked_backend.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace hexopt::compute {

namespace {

struct Pair {
    Buffer reference, tested;
};

struct Comparison {
    std::size_t different = 0;
    double largest_rel = 0;
};

// Not a number on one side only counts as an infinite difference; which one it is says nothing.
template <class T>
Comparison compare(const std::vector<std::byte>& a, const std::vector<std::byte>& b) {
    Comparison result;
    double largest = 0, difference = 0;
    for (std::size_t i = 0; i + sizeof(T) <= a.size(); i += sizeof(T)) {
        T x, y;
        std::memcpy(&x, &a[i], sizeof x);
        std::memcpy(&y, &b[i], sizeof y);
        if (std::isfinite(static_cast<double>(x)))
            largest = std::max(largest, std::abs(static_cast<double>(x)));
        if (std::memcmp(&x, &y, sizeof x) == 0 || (x != x && y != y)) continue;
        ++result.different;
        const double d = std::abs(static_cast<double>(x) - static_cast<double>(y));
        difference = std::isnan(d) ? std::numeric_limits<double>::infinity() : std::max(difference, d);
    }
    if (difference > 0) result.largest_rel = largest > 0 ? difference / largest : difference;
    return result;
}

Comparison compare(ArrayType type, Precision precision, const std::vector<std::byte>& a,
                   const std::vector<std::byte>& b) {
    if (type == ArrayType::index) {
        // Which of several equals was found, to begin the next search with: no quantity with a bound.
        Comparison result = compare<std::uint32_t>(a, b);
        result.largest_rel = 0;
        return result;
    }
    if (component_bytes(type, precision) == 8) return compare<double>(a, b);
    return compare<float>(a, b);
}

class Implementation final : public CheckedBackend {
  public:
    Implementation(Backend& reference, Backend& tested) : reference_(reference), tested_(tested) {
        capabilities_ = tested.capabilities();
        capabilities_.name =
            "checked(" + reference.capabilities().name + ", " + tested.capabilities().name + ")";
    }

    const Capabilities& capabilities() const override { return capabilities_; }
    const std::vector<KernelDifference>& differences() const override { return differences_; }

    Result<Buffer> create_buffer(std::size_t bytes, std::string_view label) override {
        auto a = reference_.create_buffer(bytes, label);
        if (!a) return a.error();
        auto b = tested_.create_buffer(bytes, label);
        if (!b) return b.error();
        // Equal, since what no dispatch has written is compared too.
        const std::vector<std::byte> zeros(bytes);
        if (auto s = reference_.upload(*a, 0, zeros); !s) return s.error();
        if (auto s = tested_.upload(*b, 0, zeros); !s) return s.error();
        pairs_.emplace(++last_id_, Pair{std::move(*a), std::move(*b)});
        return Buffer(this, last_id_, bytes);
    }

    Result<Buffer> import_buffer(void*, std::size_t) override {
        return make_error(ErrorCode::usage, "compute", "checked", "two backends cannot share one buffer");
    }

    Status upload(const Buffer& target, std::size_t offset, std::span<const std::byte> data) override {
        const Pair& pair = pairs_.at(target.ref().buffer);
        if (auto s = reference_.upload(pair.reference, offset, data); !s) return s;
        return tested_.upload(pair.tested, offset, data);
    }

    Status download(const Buffer& source, std::size_t offset, std::span<std::byte> data) override {
        return reference_.download(pairs_.at(source.ref().buffer).reference, offset, data);
    }

    Status submit(const Recorder& recorder) override {
        for (const Command& command : recorder.commands()) {
            if (auto s = run(reference_, command, true); !s) return s;
            if (auto s = run(tested_, command, false); !s) return s;
            if (command.kind == Command::Kind::dispatch)
                if (auto s = compare_buffers(command); !s) return s;
        }
        return Done{};
    }

    Status wait(double) override { return Done{}; }

  protected:
    void destroy_buffer(std::uint32_t id) override { pairs_.erase(id); }

  private:
    BufferRef translate(BufferRef ref, bool to_reference) const {
        if (ref.buffer == 0) return ref;
        const Pair& pair = pairs_.at(ref.buffer);
        return {(to_reference ? pair.reference : pair.tested).ref().buffer, ref.offset};
    }

    Status run(Backend& backend, Command command, bool to_reference) {
        command.source = translate(command.source, to_reference);
        command.target = translate(command.target, to_reference);
        if (command.kind == Command::Kind::dispatch)
            for (const ArgInfo& arg : command.kernel->args) {
                if (!arg.is_buffer) continue;
                BufferRef ref;
                std::memcpy(&ref, &command.args[arg.offset], sizeof ref);
                ref = translate(ref, to_reference);
                std::memcpy(&command.args[arg.offset], &ref, sizeof ref);
            }
        Recorder single;
        single.add(command);
        if (auto s = backend.submit(single); !s) return s;
        return backend.wait();
    }

    Status compare_buffers(const Command& command) {
        KernelDifference& total = entry(command);
        ++total.dispatches;
        for (const ArgInfo& arg : command.kernel->args) {
            if (!arg.is_buffer) continue;
            BufferRef ref;
            std::memcpy(&ref, &command.args[arg.offset], sizeof ref);
            if (ref.buffer == 0) continue;
            const Pair& pair = pairs_.at(ref.buffer);
            std::vector<std::byte> a(pair.reference.bytes()), b(a.size());
            if (auto s = reference_.download(pair.reference, 0, a); !s) return s;
            if (auto s = tested_.download(pair.tested, 0, b); !s) return s;
            if (a == b) continue;
            const Comparison result = compare(arg.type, command.precision, a, b);
            total.different_words += result.different;
            total.largest_rel = std::max(total.largest_rel, result.largest_rel);
            if (auto s = tested_.upload(pair.tested, 0, a); !s) return s;
        }
        return Done{};
    }

    KernelDifference& entry(const Command& command) {
        for (KernelDifference& d : differences_)
            if (d.kernel == command.kernel && d.precision == command.precision) return d;
        differences_.push_back({.kernel = command.kernel, .precision = command.precision});
        return differences_.back();
    }

    Backend& reference_;
    Backend& tested_;
    Capabilities capabilities_;
    std::unordered_map<std::uint32_t, Pair> pairs_;
    std::vector<KernelDifference> differences_;
    std::uint32_t last_id_ = 0;
};

} // namespace

std::unique_ptr<CheckedBackend> create_checked_backend(Backend& reference, Backend& tested) {
    return std::make_unique<Implementation>(reference, tested);
}

} // namespace hexopt::compute
