"""Every file that is no robot gets one line that says where and why; none is expanded or followed."""

import time

import pytest

from linkwind.errors import InputError
from linkwind.mechanism.importers import import_file

BODY = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
JOINT = '<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>'
TWO = f'<robot name="r">\n<link name="a"/>\n<link name="b">{BODY}</link>\n{JOINT}\n</robot>'

BOMB = (
    '<?xml version="1.0"?>\n<!DOCTYPE robot [<!ENTITY a "xxxxxxxxxx">'
    + "".join(f'<!ENTITY {y} "{f"&{x};" * 10}">' for x, y in zip("abcdefgh", "bcdefghi", strict=True))
    + ']><robot name="&i;"/>'
)
EXTERNAL = '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/hostname">]>\n<robot name="&x;"/>'

WRONG = [
    ("", "1: expected XML; got: no element found: line 1, column 0. It is no text of this kind, or damaged."),
    ("<robot>", "1: expected XML; got: no element found: line 1, column 7. "
     "It is no text of this kind, or damaged."),
    ("\x00\x01", "1: expected XML; got: not well-formed (invalid token): line 1, column 0. "
     "It is no text of this kind, or damaged."),
    ("<sdf/>", "1: <sdf>: expected <robot> (URDF) or <mujoco> (MJCF); got <sdf>. "
     "Convert the file to one of the two."),
    (BOMB, "2: expected no document type; got <!DOCTYPE robot>, which may declare entities. Remove it."),
    (EXTERNAL, "1: expected no document type; got <!DOCTYPE robot>, which may declare entities. Remove it."),
    (EXTERNAL.replace("robot", "mujoco"),
     "1: expected no document type; got <!DOCTYPE mujoco>, which may declare entities. Remove it."),
    ("<robot>" + "<a>" * 600 + "</a>" * 600 + "</robot>",
     "1: <a>: expected at most 500 elements inside each other; got more. Flatten the file."),
    ('<robot name="r"/>', '1: <robot name="r">: expected a <link>; got none. Give the file of a robot.'),
    (TWO.replace('name="b"', 'name="a"'),
     '3: <link name="a">: expected a name of its own; got that of line 2. Rename one of the two.'),
    (TWO.replace('<link name="a"/>', "<link/>"), "2: <link>: expected an attribute name; got none. Add it."),
    (TWO.replace('link="a"', 'link="c"'),
     '4: <joint name="j">: expected the name of a link; got "c". Correct it, or add that link.'),
    (TWO.replace('<parent link="a"/>', ""),
     '4: <joint name="j">: expected an element <parent>; got none. Add it.'),
    (TWO.replace(JOINT, ""),
     '1: <robot name="r">: expected one link that is no child of a joint; got "a", "b". '
     "Connect the links with joints."),
    (TWO.replace(JOINT, JOINT + JOINT),
     '4: <joint name="j">: expected a child that no other joint has ("b" hangs on <joint name="j">); '
     "got a loop. URDF describes trees."),
    (TWO.replace('link="a"', 'link="b"'),
     '4: <joint name="j">: expected joints that form a tree; got a loop through "b". URDF describes trees.'),
    (TWO.replace("continuous", "hinge"),
     '4: <joint name="j">: expected type to be one of revolute, continuous, prismatic, fixed, floating, '
     'planar, spherical; got "hinge". Use one of these.'),
    (TWO.replace("</joint>", '<axis xyz="0 0 0"/></joint>'),
     '4: <axis>: expected an axis that is not zero; got "0 0 0". Give it a direction.'),
    (TWO.replace("</joint>", '<axis xyz="0 1"/></joint>'),
     '4: <axis>: expected 3 finite numbers with spaces between them in xyz="…"; got "0 1". Correct it.'),
    (TWO.replace('value="1"', 'value="${m}"'),
     '3: <mass>: expected a finite number in value="…"; got "${m}". Expand the file with xacro first.'),
    (TWO.replace('ixx="1"', 'ixx="nan"'),
     '3: <inertia>: expected a finite number in ixx="…"; got "nan". Correct it.'),
    (TWO.replace('value="1"', 'value="-1"'),
     "3: <mass>: expected a mass of at least 0; got -1. Correct it."),
    (TWO.replace('value="1"', 'value="0"'),
     '3: <link name="b">: expected a mass above 0, as it moves; got 0. Correct it.'),
    (TWO.replace("</joint>", '<dynamics damping="-1"/></joint>'),
     "4: <dynamics>: expected damping of at least 0; got -1. A negative one would feed energy."),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_one_line_says_where_and_why(tmp_path, text, message):
    file = tmp_path / "robot.urdf"
    file.write_text(text)
    begin = time.process_time()
    with pytest.raises(InputError) as error:
        import_file(file)
    assert str(error.value) == f"{file}:{message}"
    assert time.process_time() - begin < 2.0  # a bomb takes hours


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace(BODY, ""), ": expected a link with mass; got none. Give links inertials."),
        (lambda text: text.replace("inertia ixx", "foo ixx"),
         ': joint of body "b": expected inertia to move the body; got a singular inertia'),
    ],
)  # fmt: skip
def test_nothing_to_move(tmp_path, change, message):
    file = tmp_path / "robot.urdf"
    file.write_text(change(TWO))
    with pytest.raises(InputError) as error:
        import_file(file)
    assert str(error.value).startswith(f"{file}{message}")


@pytest.mark.parametrize(
    ("argument", "message"),
    [
        ("k=1", '--at k=1: expected JOINT=VALUE with a joint that turns or slides, one of j; got "k". '
         "Use one of these."),
        ("j", '--at j: expected JOINT=VALUE with a joint that turns or slides, one of j; got "j". Use j.'),
        ("j=inf", "--at j=inf: expected a finite number; got inf. Correct it."),
    ],
)  # fmt: skip
def test_a_start_that_is_none(tmp_path, argument, message):
    file = tmp_path / "robot.urdf"
    file.write_text(TWO)
    with pytest.raises(InputError) as error:
        import_file(file, at=[argument])
    assert str(error.value) == message


def test_missing_file(tmp_path):
    with pytest.raises(
        InputError, match=r"none\.urdf: cannot be read: No such file or directory\. Check the path"
    ):
        import_file(tmp_path / "none.urdf")
