from o3d_relief.arguments import parse


def test_view_takes_the_options_of_make():
    options = parse(["view", "a.ply", "-k", "9", "--front", "-y", "--up", "z", "--max-triangles", "5"])
    assert (options.command, options.k, options.front, options.max_triangles) == ("view", 9, "-y", 5)
    assert options.sensor is None


def test_edit_has_an_output_and_a_size():
    options = parse(["edit", "a.ply", "-o", "b.ply", "--size-mm", "80", "--no-in-order"])
    assert (options.command, options.output.name, options.size_mm) == ("edit", "b.ply", 80.0)
    assert not options.in_order
    assert parse(["edit", "a.ply"]).output is None


def test_parameter_files_work_for_the_windows_too(tmp_path):
    path = tmp_path / "params.json"
    path.write_text('{"params": {"k": 17}, "view": {"front": [0, -1, 0], "up": [0, 0, 1]}}')
    for command in ("view", "edit"):
        options = parse([command, "a.ply", "--params", str(path), "--beta", "0.7"])
        assert (options.k, options.beta, tuple(options.front)) == (17, 0.7, (0.0, -1.0, 0.0))
