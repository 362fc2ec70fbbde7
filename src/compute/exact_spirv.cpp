#include "compute/exact_spirv.hpp"

#include <algorithm>
#include <spirv/unified1/spirv.hpp>

namespace hexopt::compute {

namespace {

constexpr std::size_t kHeaderWords = 5;

bool is_float_arithmetic(std::uint32_t op) {
    switch (op) {
    case spv::OpFNegate:
    case spv::OpFAdd:
    case spv::OpFSub:
    case spv::OpFMul:
    case spv::OpFDiv:
    case spv::OpFRem:
    case spv::OpFMod:
    case spv::OpVectorTimesScalar:
    case spv::OpDot:
        return true;
    default:
        return false;
    }
}

} // namespace

std::vector<std::uint32_t> forbid_contraction(SpirvBlob module) {
    std::vector<std::uint32_t> decorations;
    std::size_t first_decoration = 0;
    for (std::size_t at = kHeaderWords; at < module.size();) {
        const std::uint32_t op = module[at] & spv::OpCodeMask;
        const std::uint32_t words = std::max(1u, module[at] >> spv::WordCountShift);
        if (op == spv::OpDecorate && first_decoration == 0) first_decoration = at;
        if (is_float_arithmetic(op)) // words: op, type, result, operands
            decorations.insert(decorations.end(), {3u << spv::WordCountShift | spv::OpDecorate,
                                                   module[at + 2], spv::DecorationNoContraction});
        at += words;
    }
    std::vector<std::uint32_t> exact(module.begin(), module.end());
    if (first_decoration > 0)
        exact.insert(exact.begin() + static_cast<std::ptrdiff_t>(first_decoration), decorations.begin(),
                     decorations.end());
    return exact;
}

} // namespace hexopt::compute
