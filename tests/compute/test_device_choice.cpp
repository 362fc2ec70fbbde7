#include "compute/device_choice.hpp"

#include <catch2/catch.hpp>

using namespace hexopt;
using namespace hexopt::compute;

namespace {

VulkanDeviceInfo device(int index, std::string name, DeviceType type, bool f64 = true,
                        std::string missing = "") {
    VulkanDeviceInfo info;
    info.index = index;
    info.capabilities.name = std::move(name);
    info.capabilities.type = type;
    info.capabilities.f64 = f64;
    info.missing = std::move(missing);
    return info;
}

const std::vector<VulkanDeviceInfo> kLaptop = {
    device(0, "Lavapipe", DeviceType::software_gpu),
    device(1, "Small Iris", DeviceType::integrated_gpu, false),
    device(2, "Big Card", DeviceType::discrete_gpu),
    device(3, "Old Card", DeviceType::discrete_gpu, true, "Vulkan 1.2")};

int index_of(const std::string& request, Precision precision, const std::vector<VulkanDeviceInfo>& devices) {
    const auto choice = choose_device(request, precision, devices, nullptr);
    REQUIRE(choice);
    CHECK_FALSE(choice->reason.empty());
    return choice->use_host ? -1 : choice->index;
}

} // namespace

TEST_CASE("device choice: type decides, and a software device never beats the host") {
    CHECK(index_of("auto", Precision::f64, kLaptop) == 2);
    CHECK(index_of("auto", Precision::f32, {kLaptop[0], kLaptop[1]}) == 1);
    CHECK(index_of("auto", Precision::f64, {kLaptop[0], kLaptop[1]}) == -1);
    CHECK(index_of("auto", Precision::f64, {}) == -1);
    CHECK(index_of("vulkan", Precision::f64, {kLaptop[0], kLaptop[1]}) == 0);
    CHECK(index_of("cpu", Precision::f64, kLaptop) == -1);
}

TEST_CASE("device choice: by index and by part of the name") {
    CHECK(index_of("0", Precision::f64, kLaptop) == 0);
    CHECK(index_of("big", Precision::f64, kLaptop) == 2);
    const auto code = [](const std::string& request, Precision precision) {
        const auto choice = choose_device(request, precision, kLaptop, nullptr);
        return choice ? ErrorCode::ok : choice.error().code;
    };
    CHECK(code("card", Precision::f64) == ErrorCode::usage);
    CHECK(code("7", Precision::f64) == ErrorCode::device);
    CHECK(code("1", Precision::f64) == ErrorCode::device);
    CHECK(code("1", Precision::f32) == ErrorCode::ok);
    CHECK(code("Old", Precision::f32) == ErrorCode::device);
}

TEST_CASE("device choice: without a driver the default is the host, and a wish for Vulkan is refused") {
    const Error absent = make_error(ErrorCode::device, "compute", "libvulkan.so.1", "no Vulkan loader");
    const auto chosen = choose_device("auto", Precision::f64, {}, &absent);
    REQUIRE(chosen);
    CHECK(chosen->use_host);
    CHECK(chosen->reason.find("no Vulkan loader") != std::string::npos);
    const auto refused = choose_device("vulkan", Precision::f64, {}, &absent);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::device);
}
