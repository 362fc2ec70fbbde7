#include "io/surface_readers.hpp"

#include <cstdint>
#include <cstdlib>

/// Any bytes give an error with a reason or triangles whose ids are in range. The first byte chooses the
/// name, which tells OBJ and damaged STL.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const hexopt::Context context(1);
    const char* const names[] = {"fuzz", "fuzz.obj", "fuzz.stl"};
    const auto soup = hexopt::io_detail::read_surface_bytes(
        names[data[0] % 3], {reinterpret_cast<const char*>(data + 1), size - 1}, context);
    if (!soup) {
        if (soup.error().reasons.empty()) std::abort();
        return 0;
    }
    for (const auto& triangle : soup->triangles)
        for (hexopt::Index v : triangle)
            if (v >= soup->vertices.size()) std::abort();
    return 0;
}
