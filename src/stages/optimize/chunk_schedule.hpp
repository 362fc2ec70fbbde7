#pragma once

#include "core/csr.hpp"
#include "core/parallel.hpp"

namespace hexopt {

/// Chunks of consecutive items that add into shared rows, grouped by colour: chunks of one colour touch no
/// common row and run concurrently, colours one after the other. The order of additions into a row is fixed
/// by the chunks alone, so sums are the same bits for any number of threads.
class ChunkSchedule {
  public:
    ChunkSchedule() = default;

    /// touched[i]: the rows that item i adds into. row_count: number of rows.
    ChunkSchedule(const Csr<Index>& touched, std::size_t row_count, std::size_t chunk_size);

    /// Calls body(begin, end) once a chunk of items.
    template <class Body>
    void run(const Parallel& parallel, const Body& body) const {
        for (std::size_t colour = 0; colour < colours_.rows(); ++colour) {
            const auto chunks = colours_[colour];
            parallel.for_each(chunks.size(), 1, [&](std::size_t i) {
                const std::size_t begin = chunks[i] * chunk_size_;
                body(begin, std::min(item_count_, begin + chunk_size_));
            });
        }
    }

  private:
    std::size_t item_count_ = 0;
    std::size_t chunk_size_ = 1;
    Csr<Index> colours_;
};

} // namespace hexopt
