#pragma once

#include "core/types.hpp"

#include <span>
#include <vector>

namespace hexopt {

/// Lists of items, one list a row, stored one after the other.
template <class T>
struct Csr {
    std::vector<std::size_t> offset = {0};
    std::vector<T> item;

    std::size_t rows() const { return offset.size() - 1; }
    std::span<const T> operator[](std::size_t row) const {
        return {item.data() + offset[row], offset[row + 1] - offset[row]};
    }
};

} // namespace hexopt
