"""ancf mesh as a user types it."""


def test_a_mesh_is_made_and_described(ancf, tmp_path):
    said = ancf("mesh", "bar", "--divisions", "2", "2", "10", "--out", "b.msh", cwd=tmp_path).stdout
    assert "99 nodes, 240 tetra cells, volume 0.005" in said
    assert said.rstrip().endswith("wrote b.msh")
    assert "bottom_edges" in said
    again = ancf("mesh", "bar", "--divisions", "1", "1", "5", "--out", "b.msh", cwd=tmp_path).stdout
    assert again.rstrip().endswith("replaced b.msh")
    assert (tmp_path / "b.msh").read_text().startswith("$MeshFormat\n2.2 0 8\n")


def test_the_list_names_every_body_and_its_groups(ancf):
    said = ancf("mesh", "--list").stdout
    assert "ellipsograph: beam 1 x 0.01 x 0.02 m" in said
    assert "groups left, right, side_y0, left_edge, right_edge, solid" in said


def test_a_wrong_name_is_an_error_in_one_line(ancf):
    done = ancf("mesh", "ball", code=2)
    assert "no such body: found 'ball'" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
