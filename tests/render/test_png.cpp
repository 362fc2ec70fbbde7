#include "render/png.hpp"

#include "io/scratch.hpp"

#include <catch2/catch.hpp>
#include <random>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

using namespace hexopt;

TEST_CASE("a PNG reads back pixel for pixel in VTK") {
    std::mt19937 random(1);
    const test::Scratch scratch;
    const std::string file = (scratch / "a.png").string();
    for (const auto& [width, height] :
         {std::pair(1, 1), std::pair(7, 3), std::pair(64, 65), std::pair(301, 200)}) {
        Image image(width, height, {1, 1, 1});
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                image.set(x, y,
                          {static_cast<float>(random() % 256) / 255, static_cast<float>(x % 256) / 255,
                           static_cast<float>((x + y) % 256) / 255});
        Context context(1);
        REQUIRE(write_png(file, image, context));
        vtkNew<vtkPNGReader> reader;
        reader->SetFileName(file.c_str());
        reader->Update();
        const int* extent = reader->GetOutput()->GetDimensions();
        REQUIRE(extent[0] == width);
        REQUIRE(extent[1] == height);
        REQUIRE(reader->GetOutput()->GetNumberOfScalarComponents() == 3);
        int wrong = 0;
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const auto* got =
                    static_cast<unsigned char*>(reader->GetOutput()->GetScalarPointer(x, height - 1 - y, 0));
                const std::uint8_t* wanted = &image.bytes()[(static_cast<std::size_t>(y) * width + x) * 3];
                wrong += !std::equal(got, got + 3, wanted);
            }
        CHECK(wrong == 0);
    }
}

TEST_CASE("a picture that cannot be written is an error") {
    Context context(1);
    const Status status = write_png("/no/such/folder/a.png", Image(2, 2, {0, 0, 0}), context);
    REQUIRE_FALSE(status);
    CHECK(status.error().code == ErrorCode::output_failed);
}

TEST_CASE("text is drawn in dots, unknown characters as a question mark") {
    const auto drawn = [](std::string_view text) {
        Image image(40, 9, {1, 1, 1});
        image.write(1, 1, 1, {0, 0, 0}, text);
        return image.bytes();
    };
    CHECK(drawn("abc") == drawn("ABC"));
    CHECK(drawn("\x01") == drawn("?"));
    CHECK(drawn(" ") == Image(40, 9, {1, 1, 1}).bytes());
    std::string all;
    for (char c : std::string_view("0123456789abcdefghijklmnopqrstuvwxyz.,:;-+=_/()<>%#*|'")) {
        CHECK(drawn(std::string(1, c)) != drawn("?"));
        for (char other : all) CHECK(drawn(std::string(1, c)) != drawn(std::string(1, other)));
        all += c;
    }
    // Text that leaves the image is cut.
    Image image(4, 4, {1, 1, 1});
    image.write(-3, -3, 2, {0, 0, 0}, "WW");
    CHECK(image.bytes().size() == 48);
}
