#pragma once

#include "samples/samples.hpp"

#include <catch2/catch.hpp>

namespace hexopt::test {

/// A sample with a fraction of its cells tangled; always the same one.
inline HexMesh tangled_mesh(const char* name, double fraction, Index size = 0) {
    Context context(1, 3);
    SampleOptions options;
    options.size = size;
    options.tangled = fraction;
    Result<HexMesh> mesh = make_sample(name, options, context);
    REQUIRE(mesh);
    return std::move(*mesh);
}

} // namespace hexopt::test
