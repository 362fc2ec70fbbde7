#include "io/pack_cad.hpp"

#include <cstdint>
#include <cstring>
#include <type_traits>

namespace hexopt::io_detail {

namespace {

/// Appends to bytes; the same calls in the same order read them again.
struct Packer {
    std::string bytes;

    template <class T>
    bool number(const T& value) {
        static_assert(std::is_trivially_copyable_v<T>);
        bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
        return true;
    }
    template <class T>
    bool numbers(const std::vector<T>& values) {
        static_assert(std::is_trivially_copyable_v<T>);
        number(static_cast<std::uint64_t>(values.size()));
        bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
        return true;
    }
    bool texts(const std::vector<std::string>& values) {
        number(static_cast<std::uint64_t>(values.size()));
        for (const std::string& value : values) text(value);
        return true;
    }
    bool text(const std::string& value) {
        number(static_cast<std::uint64_t>(value.size()));
        bytes += value;
        return true;
    }
};

struct Unpacker {
    std::string_view bytes;

    bool raw(void* target, std::size_t size) {
        if (size > bytes.size()) return false;
        if (size > 0) std::memcpy(target, bytes.data(), size);
        bytes.remove_prefix(size);
        return true;
    }
    template <class T>
    bool number(T& value) {
        return raw(&value, sizeof value);
    }
    bool count(std::uint64_t& value, std::size_t bytes_each) {
        return number(value) && value <= bytes.size() / bytes_each;
    }
    template <class T>
    bool numbers(std::vector<T>& values) {
        std::uint64_t size = 0;
        if (!count(size, sizeof(T))) return false;
        values.resize(size);
        return raw(values.data(), size * sizeof(T));
    }
    bool texts(std::vector<std::string>& values) {
        std::uint64_t size = 0;
        if (!count(size, sizeof size)) return false;
        values.resize(size);
        for (std::string& value : values)
            if (!text(value)) return false;
        return true;
    }
    bool text(std::string& value) {
        std::uint64_t size = 0;
        if (!count(size, 1)) return false;
        value.resize(size);
        return raw(value.data(), size);
    }
};

/// One order of the members for both ways.
template <class Archive, class Outcome, class Failure>
bool pass(Archive& archive, Outcome& outcome, Failure& error) {
    auto& soup = outcome.surface.soup;
    return archive.numbers(soup.vertices) && archive.numbers(soup.triangles) && archive.numbers(soup.patch) &&
           archive.texts(soup.patch_names) && archive.numbers(soup.patch_group) &&
           archive.numbers(outcome.surface.patch_colour) && archive.number(outcome.surface.face_count) &&
           archive.number(outcome.surface.failed_faces) && archive.numbers(outcome.points) &&
           archive.texts(outcome.warnings) && archive.number(error.code) && archive.text(error.stage) &&
           archive.text(error.where) && archive.texts(error.reasons);
}

} // namespace

std::string pack(const CadOutcome& outcome) {
    Packer packer;
    const Error error = outcome.error.value_or(Error{ErrorCode::ok, {}, {}, {}});
    pass(packer, outcome, error);
    return std::move(packer.bytes);
}

bool unpack(std::string_view bytes, CadOutcome& outcome) {
    Unpacker unpacker{bytes};
    Error error;
    if (!pass(unpacker, outcome, error) || !unpacker.bytes.empty()) return false;
    if (error.code != ErrorCode::ok) outcome.error = std::move(error);
    return true;
}

} // namespace hexopt::io_detail
