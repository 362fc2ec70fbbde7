#pragma once

#include "core/result.hpp"
#include "core/types.hpp"
#include "io/atomic_file.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace hexopt {

/// Types whose bytes are their value, so that arrays of them are stored as one block. Specialise for structs
/// of such members without padding.
template <class T>
inline constexpr bool kIsPlain = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
template <>
inline constexpr bool kIsPlain<Point> = true;
template <class T, std::size_t N>
inline constexpr bool kIsPlain<std::array<T, N>> = kIsPlain<T>;

/// What a block holds, as the byte before it says: a reader that expects something else notices.
template <class T>
constexpr std::uint8_t archive_tag() {
    if constexpr (std::is_same_v<T, bool>)
        return 0x11;
    else if constexpr (std::is_floating_point_v<T>)
        return static_cast<std::uint8_t>(0x30 | sizeof(T));
    else if constexpr (std::is_signed_v<T>)
        return static_cast<std::uint8_t>(0x40 | sizeof(T));
    else
        return static_cast<std::uint8_t>(0x50 | sizeof(T));
}
inline constexpr std::uint8_t kTextTag = 0x60, kBlockTag = 0x70, kListTag = 0x71, kOptionalTag = 0x72;

/// Writes values one after another in the machine's own layout. A struct T takes part through a function
/// `template <class A> void archive(A&, T&)` that hands its members to operator() of writer and reader alike.
/// What goes wrong is kept in status(); nothing is written after that.
class ArchiveWriter {
  public:
    explicit ArchiveWriter(AtomicFile& file) : file_(&file) {}

    template <class... T>
    void operator()(const T&... values) {
        (put(values), ...);
    }

    /// Bytes as they are.
    void write(std::string_view bytes);
    const Status& status() const { return status_; }
    std::uint32_t checksum() const { return checksum_; } ///< CRC-32 of all bytes so far

  private:
    void put_size(std::uint8_t tag, std::uint64_t size) {
        write({reinterpret_cast<const char*>(&tag), 1});
        write({reinterpret_cast<const char*>(&size), sizeof size});
    }

    template <class T>
    void put(const T& value) {
        if constexpr (std::is_arithmetic_v<T>) {
            const std::uint8_t tag = archive_tag<T>();
            write({reinterpret_cast<const char*>(&tag), 1});
            write({reinterpret_cast<const char*>(&value), sizeof value});
        } else if constexpr (kIsPlain<T>) {
            put_size(kBlockTag, sizeof value);
            write({reinterpret_cast<const char*>(&value), sizeof value});
        } else {
            archive(*this, const_cast<T&>(value)); // the same function reads; this one leaves it as it is
        }
    }
    void put(const std::string& text) {
        put_size(kTextTag, text.size());
        write(text);
    }
    template <class T>
    void put(const std::vector<T>& list) {
        if constexpr (kIsPlain<T>) {
            put_size(kBlockTag, list.size() * sizeof(T));
            write({reinterpret_cast<const char*>(list.data()), list.size() * sizeof(T)});
        } else {
            put_size(kListTag, list.size());
            for (const T& value : list) put(value);
        }
    }
    template <class A, class B>
    void put(const std::pair<A, B>& both) {
        put(both.first);
        put(both.second);
    }
    template <class T>
    void put(const std::optional<T>& value) {
        put_size(kOptionalTag, value ? 1 : 0);
        if (value) put(*value);
    }

    AtomicFile* file_;
    Status status_ = Done{};
    std::uint32_t checksum_ = 0;
};

/// Reads what ArchiveWriter wrote, in the same order. Nothing is assumed about the bytes: what does not fit
/// sets is_sound() to false, leaves the value as it is, and ends reading. Sizes are compared with what is
/// left before memory is asked for.
class ArchiveReader {
  public:
    explicit ArchiveReader(std::string_view bytes) : rest_(bytes) {}

    template <class... T>
    void operator()(T&... values) {
        (get(values), ...);
    }

    bool is_sound() const { return sound_; }
    bool at_end() const { return rest_.empty(); }
    /// To be called where a value that was read cannot be.
    void refuse() { sound_ = false; }

  private:
    bool take(void* to, std::size_t size) {
        sound_ = sound_ && size <= rest_.size();
        if (!sound_) return false;
        if (size > 0) std::memcpy(to, rest_.data(), size);
        rest_.remove_prefix(size);
        return true;
    }
    bool take_tag(std::uint8_t wanted) {
        std::uint8_t tag = 0;
        return take(&tag, 1) && (sound_ = tag == wanted);
    }
    /// Number of items, each of which takes at least `least` bytes.
    std::size_t take_size(std::uint8_t tag, std::size_t least) {
        std::uint64_t size = 0;
        if (!take_tag(tag) || !take(&size, sizeof size)) return 0;
        sound_ = size <= rest_.size() / least;
        return sound_ ? static_cast<std::size_t>(size) : 0;
    }

    template <class T>
    void get(T& value) {
        if constexpr (std::is_same_v<T, bool>) {
            std::uint8_t byte = 0;
            if (!take_tag(archive_tag<bool>()) || !take(&byte, 1)) return;
            sound_ = byte <= 1;
            value = byte == 1;
        } else if constexpr (std::is_arithmetic_v<T>) {
            if (take_tag(archive_tag<T>())) take(&value, sizeof value);
        } else if constexpr (kIsPlain<T>) {
            if (take_size(kBlockTag, 1) == sizeof value)
                take(&value, sizeof value);
            else
                sound_ = false;
        } else {
            archive(*this, value);
        }
    }
    void get(std::string& text) {
        text.resize(take_size(kTextTag, 1));
        take(text.data(), text.size());
    }
    template <class T>
    void get(std::vector<T>& list) {
        if constexpr (kIsPlain<T>) {
            const std::size_t bytes = take_size(kBlockTag, 1);
            if (bytes % sizeof(T) != 0) return refuse();
            list.resize(bytes / sizeof(T));
            take(list.data(), bytes);
        } else {
            const std::size_t count = take_size(kListTag, 1);
            list.clear();
            for (std::size_t i = 0; i < count && sound_; ++i) get(list.emplace_back());
        }
    }
    template <class A, class B>
    void get(std::pair<A, B>& both) {
        get(both.first);
        get(both.second);
    }
    template <class T>
    void get(std::optional<T>& value) {
        const std::size_t count = take_size(kOptionalTag, 1);
        value.reset();
        if (count > 1) return refuse();
        if (count == 1 && sound_) get(value.emplace());
    }

    std::string_view rest_;
    bool sound_ = true;
};

/// Enumerations: a value beyond the last one is none.
template <class Archive, class T>
void archive_enum(Archive& a, T& value, T last) {
    auto number = static_cast<std::uint32_t>(value);
    a(number);
    if constexpr (std::is_same_v<Archive, ArchiveReader>) {
        if (number > static_cast<std::uint32_t>(last)) return a.refuse();
        value = static_cast<T>(number);
    }
}

} // namespace hexopt
