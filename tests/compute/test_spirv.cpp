#include "compute/exact_spirv.hpp"
#include "compute/kernel_args.hpp"

#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <spirv-tools/libspirv.h>
#include <spirv/unified1/GLSL.std.450.h>
#include <spirv/unified1/spirv.hpp>
#include <string>

using namespace hexopt::compute;

namespace {

/// What a module says of its interface, read instruction by instruction.
struct Reflection {
    std::uint32_t local_size = 0;
    std::map<std::uint32_t, std::uint32_t> member_offset; ///< of the push constant block
    std::map<std::uint32_t, bool> member_is_address;
    bool uses_double = false;
    std::size_t float_operations = 0, no_contraction = 0;
    /// Instructions whose rounding Vulkan leaves open, by the function they stand in.
    std::map<std::string, std::size_t> inexact;
};

/// Extended instructions that return one of their arguments or its bits, or are exact by definition.
bool is_exact_extended(std::uint32_t instruction) {
    switch (instruction) {
    case GLSLstd450FAbs:
    case GLSLstd450FMin:
    case GLSLstd450FMax:
    case GLSLstd450Fma:
    case GLSLstd450UMin:
    case GLSLstd450UMax:
    case GLSLstd450PackDouble2x32:
    case GLSLstd450UnpackDouble2x32:
        return true;
    default:
        return false;
    }
}

class Reader {
  public:
    explicit Reader(SpirvBlob module) {
        REQUIRE(module.size() > 5);
        REQUIRE(module[0] == spv::MagicNumber);
        for (std::size_t at = 5; at < module.size();) {
            const std::uint32_t words = module[at] >> spv::WordCountShift;
            REQUIRE(words > 0);
            read(static_cast<spv::Op>(module[at] & spv::OpCodeMask), module.subspan(at + 1, words - 1));
            at += words;
        }
    }

    Reflection result() {
        for (const auto& [id, storage_and_type] : variables_) {
            if (storage_and_type.first != spv::StorageClassPushConstant) continue;
            const std::uint32_t block = pointee_.at(storage_and_type.second);
            r_.member_offset = offsets_.at(block);
            const auto& members = struct_members_.at(block);
            for (std::uint32_t m = 0; m < members.size(); ++m)
                r_.member_is_address[m] =
                    pointer_storage_.contains(members[m]) &&
                    pointer_storage_.at(members[m]) == spv::StorageClassPhysicalStorageBuffer;
        }
        return r_;
    }

  private:
    void read(spv::Op op, SpirvBlob w) {
        switch (op) {
        case spv::OpExecutionMode:
            if (w[1] == spv::ExecutionModeLocalSize) r_.local_size = w[2] * w[3] * w[4];
            break;
        case spv::OpCapability:
            r_.uses_double = r_.uses_double || w[0] == spv::CapabilityFloat64;
            break;
        case spv::OpMemberDecorate:
            if (w[2] == spv::DecorationOffset) offsets_[w[0]][w[1]] = w[3];
            break;
        case spv::OpDecorate:
            r_.no_contraction += w[1] == spv::DecorationNoContraction;
            break;
        case spv::OpTypePointer:
            pointer_storage_[w[0]] = w[1];
            pointee_[w[0]] = w[2];
            break;
        case spv::OpTypeStruct:
            struct_members_[w[0]].assign(w.begin() + 1, w.end());
            break;
        case spv::OpVariable:
            variables_[w[1]] = {w[2], w[0]};
            break;
        case spv::OpName:
            names_[w[0]] = reinterpret_cast<const char*>(&w[1]);
            break;
        case spv::OpFunction:
            function_ = names_[w[1]];
            break;
        case spv::OpExtInst:
            if (!is_exact_extended(w[3])) ++r_.inexact[function_];
            break;
        case spv::OpFDiv:
        case spv::OpFRem:
        case spv::OpFMod:
        case spv::OpDot:
            ++r_.inexact[function_];
            ++r_.float_operations;
            break;
        case spv::OpFAdd:
        case spv::OpFSub:
        case spv::OpFMul:
        case spv::OpFNegate:
        case spv::OpVectorTimesScalar:
            ++r_.float_operations;
            break;
        default:
            break;
        }
    }

    Reflection r_;
    std::map<std::uint32_t, std::string> names_;
    std::string function_;
    std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> offsets_;
    std::map<std::uint32_t, std::vector<std::uint32_t>> struct_members_;
    std::map<std::uint32_t, std::uint32_t> pointer_storage_, pointee_;
    std::map<std::uint32_t, std::pair<std::uint32_t, std::uint32_t>> variables_;
};

bool is_valid(SpirvBlob module) {
    spv_context context = spvContextCreate(SPV_ENV_VULKAN_1_2);
    spv_validator_options options = spvValidatorOptionsCreate();
    spvValidatorOptionsSetScalarBlockLayout(options, true);
    spv_const_binary_t binary{module.data(), module.size()};
    spv_diagnostic diagnostic = nullptr;
    const spv_result_t result = spvValidateWithOptions(context, options, &binary, &diagnostic);
    if (diagnostic) UNSCOPED_INFO(diagnostic->error);
    spvDiagnosticDestroy(diagnostic);
    spvValidatorOptionsDestroy(options);
    spvContextDestroy(context);
    return result == SPV_SUCCESS;
}

} // namespace

TEST_CASE("spirv: every module has the arguments, local size and precision of kernels.def") {
    std::set<std::string_view> names;
    for (const KernelInfo& kernel : kernels()) {
        CHECK(names.insert(kernel.name).second);
        CHECK(kernel.args_bytes <= kMaxArgsBytes);
        CHECK(kernel.args.back().name == "count");
        for (int p = 0; p < kPrecisionCount; ++p) {
            INFO(kernel.name << " " << name_of(static_cast<Precision>(p)));
            const Reflection r = Reader(kernel.spirv[p]).result();
            CHECK(r.local_size == kernel.local_size);
            REQUIRE(r.member_offset.size() == kernel.args.size());
            for (std::uint32_t m = 0; m < kernel.args.size(); ++m) {
                INFO(kernel.args[m].name);
                CHECK(r.member_offset.at(m) == kernel.args[m].offset);
                CHECK(r.member_is_address.at(m) == kernel.args[m].is_buffer);
            }
            if (p == static_cast<int>(Precision::f32)) CHECK_FALSE(r.uses_double);
        }
    }
}

TEST_CASE("spirv: modules are valid before and after their arithmetic is made exact") {
    for (const KernelInfo& kernel : kernels())
        for (int p = 0; p < kPrecisionCount; ++p) {
            INFO(kernel.name << " " << name_of(static_cast<Precision>(p)));
            CHECK(is_valid(kernel.spirv[p]));
            const auto exact = forbid_contraction(kernel.spirv[p]);
            CHECK(is_valid(exact));
            const Reflection r = Reader(exact).result();
            CHECK(r.no_contraction >= r.float_operations);
        }
}

TEST_CASE("spirv: what Vulkan rounds as it likes stands in divide() and exact_sqrt() alone") {
    std::size_t found = 0;
    for (const KernelInfo& kernel : kernels())
        for (int p = 0; p < kPrecisionCount; ++p) {
            INFO(kernel.name << " " << name_of(static_cast<Precision>(p)));
            for (const auto& [function, count] : Reader(kernel.spirv[p]).result().inexact) {
                INFO(function << ": " << count);
                CHECK((function.starts_with("divide(") || function.starts_with("exact_sqrt(")));
                ++found;
            }
        }
    CHECK(found > 0);
}
