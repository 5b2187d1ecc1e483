"""Hosting an FMU from anybody: safely opened, mapped by name or by table, run in a process of its own.

==================  ================================================================================
``archive``         the zip file, checked before use
``facts``           what the FMU says about itself, ``description`` reads it
``quantities``      what a host of forces can give and take, and the units of it
``names``           what a variable's name tells about it
``entries``         what an entry of the scenario's table says
``links``           what a mapping is made of
``mapping``         which variable is which quantity of which body: names and the scenario's table
``checks``          what must hold of it
``listing``         the mapping as a table to read, and as the beginning of one to write
``transfer``        motion → inputs, outputs → wrench
``response``        directional derivatives → the matrix G, ``derivatives`` checks these
``planning``        from abilities and settings to a plan
``plan``            what a worker has to know
``library``         FMPy's classes: every call marked and checked
``remote``          the library in another process, called by ``message``; ``wine`` for those of Windows
``binding``         one instance, FMI 2 and 3 alike
``cosimulation``    stepping
``modelexchange``   integrating
``runner``          the instances of one FMU, ``saved`` their states
``following``       the worker on the processor of its host
``channel``         the messages between host and worker
``worker``          the process with the runner, ``process`` the host's end of it, ``inprocess`` without one
``instances``       all of it put together: from a file and a scenario's settings to something that steps
==================  ================================================================================

Time in the lock step: the first evaluation reads the outputs in initialisation mode. Every later one steps
from the last communication point to the new one, with the motion of the new point as inputs, held over the
step (Co-Simulation), or running linearly from the accepted to the new motion (Model Exchange). For a force
without memory that is the force at the new point. What the FMU remembers follows the trial motion; where it
has FMU state, the same evaluation again goes back first, to before the step.
"""
