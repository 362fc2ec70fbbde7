#include "stages/optimize/chunk_schedule.hpp"

namespace hexopt {

namespace {

/// For every row the chunks that touch it, without repetition.
Csr<Index> chunks_of_rows(const Csr<Index>& touched, std::size_t row_count, std::size_t chunk_size) {
    Csr<Index> result;
    std::vector<Index> last(row_count, kNoIndex);
    const auto for_each_new = [&](auto&& visit) {
        std::fill(last.begin(), last.end(), kNoIndex);
        for (std::size_t item = 0; item < touched.rows(); ++item) {
            const Index chunk = static_cast<Index>(item / chunk_size);
            for (Index row : touched[item])
                if (last[row] != chunk) visit(row, last[row] = chunk);
        }
    };
    result.offset.assign(row_count + 1, 0);
    for_each_new([&](Index row, Index) { ++result.offset[row + 1]; });
    for (std::size_t r = 0; r < row_count; ++r) result.offset[r + 1] += result.offset[r];
    result.item.resize(result.offset.back());
    std::vector<std::size_t> next(result.offset.begin(), result.offset.end() - 1);
    for_each_new([&](Index row, Index chunk) { result.item[next[row]++] = chunk; });
    return result;
}

} // namespace

ChunkSchedule::ChunkSchedule(const Csr<Index>& touched, std::size_t row_count, std::size_t chunk_size)
    : item_count_(touched.rows()), chunk_size_(chunk_size) {
    const std::size_t chunk_count = (item_count_ + chunk_size - 1) / chunk_size;
    const Csr<Index> row_chunk = chunks_of_rows(touched, row_count, chunk_size);
    std::vector<Index> colour(chunk_count, kNoIndex), forbidden_by;
    std::vector<std::size_t> count;
    for (Index chunk = 0; chunk < chunk_count; ++chunk) {
        const std::size_t end = std::min(item_count_, (chunk + std::size_t{1}) * chunk_size);
        for (std::size_t item = chunk * chunk_size; item < end; ++item)
            for (Index row : touched[item])
                for (Index other : row_chunk[row])
                    if (colour[other] != kNoIndex) forbidden_by[colour[other]] = chunk;
        Index chosen = 0;
        while (chosen < count.size() && forbidden_by[chosen] == chunk) ++chosen;
        if (chosen == count.size()) {
            count.push_back(0);
            forbidden_by.push_back(kNoIndex);
        }
        colour[chunk] = chosen;
        ++count[chosen];
    }
    colours_.offset.assign(1, 0);
    for (std::size_t c : count) colours_.offset.push_back(colours_.offset.back() + c);
    colours_.item.resize(chunk_count);
    std::vector<std::size_t> next(colours_.offset.begin(), colours_.offset.end() - 1);
    for (Index chunk = 0; chunk < chunk_count; ++chunk) colours_.item[next[colour[chunk]]++] = chunk;
}

} // namespace hexopt
