#!/usr/bin/env perl
# A rod on a hinge about the world's z axis, by the classical Runge-Kutta method: an engine of proofroll in Perl.
# proofroll run pendulum --engine rod@program:examples/workers/rod.pl
use strict;
use warnings;
use JSON::PP;
$| = 1;
my ($body, $g, $dt, $t, $angle, $spin);

sub acceleration {    # torque of gravity over the moment of inertia, both about the hinge
    my ($c, $s, @com) = (cos $_[0], sin $_[0], @{ $body->{com} });
    my ($x, $y) = ($c * $com[0] - $s * $com[1], $s * $com[0] + $c * $com[1]);
    return $body->{mass} * ($x * $g->[1] - $y * $g->[0]) / ($body->{inertia}[2][2] + $body->{mass} * ($x**2 + $y**2));
}

sub step {
    my ($w1, $a1) = ($spin, acceleration($angle));
    my ($w2, $a2) = ($spin + $dt / 2 * $a1, acceleration($angle + $dt / 2 * $w1));
    my ($w3, $a3) = ($spin + $dt / 2 * $a2, acceleration($angle + $dt / 2 * $w2));
    my ($w4, $a4) = ($spin + $dt * $a3, acceleration($angle + $dt * $w3));
    $angle += $dt / 6 * ($w1 + 2 * $w2 + 2 * $w3 + $w4);
    $spin += $dt / 6 * ($a1 + 2 * $a2 + 2 * $a3 + $a4);
    $t += $dt;
}

sub sample {
    return { p_WB => [[0, 0, 0]], v_WB => [[0, 0, 0]], w_WB => [[0, 0, $spin]],
             q_WB => [[cos($angle / 2), 0, 0, sin($angle / 2)]] };
}

my %form = (provides => ["revolute joints"], order => 4, presets => { matched => { dt => 0.002 } });
while (defined(my $line = <STDIN>)) {
    my ($asked, $answer) = (decode_json($line));
    if ($asked->{do} eq "describe") {
        $answer = { protocol => 1, name => "rod", version => "1.0", formulations => { angle => \%form } };
    } elsif ($asked->{do} eq "build") {
        my ($rod, $hinge) = ($asked->{scene}{mechanism}, $asked->{scene}{mechanism}{joints}[0]);
        ($body, $g, $dt, $t) = ($rod->{bodies}[0], $rod->{gravity}, $asked->{settings}{dt}, 0);
        ($angle, $spin) = ($hinge->{q0}[0], $hinge->{v0}[0]);
        $answer = { sample => sample(), built => { mass => [$body->{mass}], gravity => $g,
                    angular_acceleration => [[0, 0, acceleration($angle)]] } };
        $answer = { refused => "more than one body" } if @{ $rod->{bodies} } > 1;
    } else {
        step() while $t < $asked->{to} - $dt / 2;
        $answer = { sample => sample() };
    }
    print encode_json($answer), "\n";
}
