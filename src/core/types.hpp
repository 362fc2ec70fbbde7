#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

namespace hexopt {

using Index = std::uint32_t;                 ///< vertex, cell or entity number, 0-based
inline constexpr Index kNoIndex = ~Index{0}; ///< "none"
using Point = glm::dvec3;                    ///< position or displacement in model units

} // namespace hexopt
