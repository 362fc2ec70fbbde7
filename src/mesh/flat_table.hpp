#pragma once

#include "core/random.hpp"
#include "core/types.hpp"

#include <cstdint>
#include <vector>

namespace hexopt {

/// Map from 64-bit keys (not ~0) to numbers: open addressing in two flat arrays, 12 bytes a slot, at most 3/4
/// full.
class FlatTable {
  public:
    std::size_t size() const { return size_; }

    /// The number stored under key, or kNoIndex.
    Index find(std::uint64_t key) const {
        if (key_.empty()) return kNoIndex;
        return value_[slot_of(key)];
    }

    /// The number stored under key; `value` is stored first if there is none.
    Index find_or_insert(std::uint64_t key, Index value) {
        if (size_ * 4 >= key_.size() * 3) grow();
        const std::size_t slot = slot_of(key);
        if (key_[slot] == key) return value_[slot];
        key_[slot] = key;
        value_[slot] = value;
        ++size_;
        return value;
    }

    /// Takes out what has a number of at least `value`.
    void drop_from(Index value) {
        FlatTable left;
        left.reset(key_.size());
        for (std::size_t i = 0; i < key_.size(); ++i)
            if (key_[i] != kEmpty && value_[i] < value) left.take(key_[i], value_[i]);
        *this = std::move(left);
    }

  private:
    static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

    std::size_t slot_of(std::uint64_t key) const {
        const std::size_t mask = key_.size() - 1;
        std::size_t slot = mix_bits(key) & mask;
        while (key_[slot] != key && key_[slot] != kEmpty) slot = (slot + 1) & mask;
        return slot;
    }

    void grow() {
        FlatTable larger;
        larger.reset(key_.empty() ? 64 : 2 * key_.size());
        for (std::size_t i = 0; i < key_.size(); ++i)
            if (key_[i] != kEmpty) larger.take(key_[i], value_[i]);
        *this = std::move(larger);
    }

    void reset(std::size_t slots) {
        key_.assign(slots, kEmpty);
        value_.assign(slots, kNoIndex);
        size_ = 0;
    }

    /// There is room, and no such key yet.
    void take(std::uint64_t key, Index value) {
        const std::size_t slot = slot_of(key);
        key_[slot] = key;
        value_[slot] = value;
        ++size_;
    }

    std::vector<std::uint64_t> key_;
    std::vector<Index> value_;
    std::size_t size_ = 0;
};

} // namespace hexopt
