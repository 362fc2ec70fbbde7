#include "io/readers.hpp"

#include <cstdint>
#include <cstdlib>

/// Any bytes give an error with a reason or a mesh whose ids are in range.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    hexopt::Context context(1);
    const auto file =
        hexopt::io_detail::read_mesh_bytes("fuzz", {reinterpret_cast<const char*>(data), size}, context, {});
    if (!file) {
        if (file.error().reasons.empty()) std::abort();
        return 0;
    }
    for (const hexopt::Cell& cell : file->mesh.cells)
        for (hexopt::Index v : cell)
            if (v >= file->mesh.vertex_count()) std::abort();
    return 0;
}
